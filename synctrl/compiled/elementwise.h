/* What is done with many numbers one after another, see elementwise.c. */
void sines(const double *q, double *sine, double *cosine, long count);
void rub(double *moving, const double *v, const double *viscous, const double *coulomb, const double *smoothing,
         long count);
void combine(double *out, const double *y, double h, const double *slope, long count);
void conclude(double *y, double h, const double *k1, const double *k2, const double *k3, const double *k4, long count);
