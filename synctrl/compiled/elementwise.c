/* What is done with many numbers one after another, whatever robots, joints or lanes they belong to.
 *
 * Above this text stand vectors and functions in as many lanes as the machine has: the robots of a small cell stand in
 * fewer, and would leave most of them empty.
 */

/* Sines and cosines. Rows may be read and written up to the end of a vector, see `room` of lanes.py. */
void sines(const double *q, double *sine, double *cosine, long count) {
    for (long j = 0; j < count; j += LANES) {
        vec s, c;
        v_sincos(load(q + j), &s, &c);
        store(sine + j, s);
        store(cosine + j, c);
    }
}

/* Take friction off what moves joints; of rows as above. */
void rub(double *moving, const double *v, const double *viscous, const double *coulomb, const double *smoothing,
         long count) {
    for (long j = 0; j < count; j += LANES) {
        vec fast = load(v + j), dry = load(coulomb + j) * v_tanh(fast / load(smoothing + j));
        store(moving + j, load(moving + j) - (load(viscous + j) * fast + dry));
    }
}

/* out = y + h slope */
void combine(double *out, const double *y, double h, const double *slope, long count) {
    long j = 0;
    for (; j + LANES <= count; j += LANES) store(out + j, load(y + j) + h * load(slope + j));
    for (; j < count; j++) out[j] = y[j] + h * slope[j];
}

/* y += h (k1 + 2 (k2 + k3) + k4) */
void conclude(double *y, double h, const double *k1, const double *k2, const double *k3, const double *k4, long count) {
    long j = 0;
    for (; j + LANES <= count; j += LANES) {
        vec middle = 2.0 * (load(k2 + j) + load(k3 + j));
        store(y + j, load(y + j) + h * (load(k1 + j) + middle + load(k4 + j)));
    }
    for (; j < count; j++) y[j] += h * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]);
}
