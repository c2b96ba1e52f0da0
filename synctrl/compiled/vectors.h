#include <math.h>
#include <stddef.h>
#include <string.h>
#if LANES == 1
typedef double vec;
typedef long long ivec;
static inline vec splat(double x) { return x; }
static inline double lane(vec x, int l) { (void)l; return x; }
static inline ivec is_less(vec a, vec b) { return -(ivec)(a < b); }
static inline ivec is_less_equal(vec a, vec b) { return -(ivec)(a <= b); }
static inline ivec is_equal(vec a, vec b) { return -(ivec)(a == b); }
static inline ivec is_different(vec a, vec b) { return -(ivec)(a != b); }
static inline int any(ivec m) { return m != 0; }
static inline vec choose(ivec m, vec a, vec b) { return m ? a : b; }
#else
typedef double vec __attribute__((vector_size(8 * LANES)));
typedef long long ivec __attribute__((vector_size(8 * LANES)));
static inline vec splat(double x) { return x - (vec){0}; }
static inline double lane(vec x, int l) { return x[l]; }
static inline ivec is_less(vec a, vec b) { return (ivec)(a < b); }
static inline ivec is_less_equal(vec a, vec b) { return (ivec)(a <= b); }
static inline ivec is_equal(vec a, vec b) { return (ivec)(a == b); }
static inline ivec is_different(vec a, vec b) { return (ivec)(a != b); }
static inline int any(ivec m) { long long x = 0; for (int l = 0; l < LANES; l++) x |= m[l]; return x != 0; }
static inline vec choose(ivec m, vec a, vec b) { return (vec)((m & (ivec)a) | (~m & (ivec)b)); }
#endif
static inline vec load(const double *p) { vec x; memcpy(&x, p, sizeof x); return x; }
static inline void store(double *p, vec x) { memcpy(p, &x, sizeof x); }
#if LANES == 1
#define EACH(name, call) static inline vec name(vec x) { return call(x); }
#define EACH2(name, call) static inline vec name(vec x, vec y) { return call(x, y); }
static inline vec gather(const double *b, const int *i) { return b[i[0]]; }
#else
#define EACH(name, call) static inline vec name(vec x) { for (int l = 0; l < LANES; l++) x[l] = call(x[l]); return x; }
#define EACH2(name, call) static inline vec name(vec x, vec y) { for (int l = 0; l < LANES; l++) x[l] = call(x[l], y[l]); return x; }
static inline vec gather(const double *b, const int *i) { vec x; for (int l = 0; l < LANES; l++) x[l] = b[i[l]]; return x; }
#endif
EACH(v_sin, sin) EACH(v_cos, cos) EACH(v_tan, tan) EACH(v_tanh, tanh) EACH(v_exp, exp) EACH(v_log, log) EACH(v_sqrt, sqrt)
EACH(v_asin, asin) EACH(v_acos, acos) EACH(v_atan, atan) EACH2(v_atan2, atan2) EACH2(v_pow, pow) EACH(v_fabs, fabs)
EACH(v_sinh, sinh) EACH(v_cosh, cosh) EACH(v_log1p, log1p) EACH(v_expm1, expm1) EACH2(v_hypot, hypot) EACH(v_erf, erf)
EACH(v_floor, floor) EACH(v_ceil, ceil) EACH2(v_copysign, copysign)
static inline vec v_fmin(vec a, vec b) { return choose(is_less(a, b), a, b); }
static inline vec v_fmax(vec a, vec b) { return choose(is_less(b, a), a, b); }
static inline vec v_lt(vec a, vec b) { return choose(is_less(a, b), splat(1), splat(0)); }
static inline vec v_le(vec a, vec b) { return choose(is_less_equal(a, b), splat(1), splat(0)); }
static inline vec v_eq(vec a, vec b) { return choose(is_equal(a, b), splat(1), splat(0)); }
static inline vec v_ne(vec a, vec b) { return choose(is_different(a, b), splat(1), splat(0)); }
static inline vec v_not(vec a) { return v_eq(a, splat(0)); }
static inline vec v_and(vec a, vec b) { return choose(is_different(a, splat(0)) & is_different(b, splat(0)), splat(1), splat(0)); }
static inline vec v_or(vec a, vec b) { return choose(is_different(a, splat(0)) | is_different(b, splat(0)), splat(1), splat(0)); }
static inline vec v_if_else_zero(vec c, vec x) { return choose(is_different(c, splat(0)), x, splat(0)); }
static inline vec v_sign(vec x) { return v_lt(splat(0), x) - v_lt(x, splat(0)); }
static inline void v_sincos(vec x, vec *s, vec *c) { *s = v_sin(x); *c = v_cos(x); }
/* 1 in lanes of a mask, else 0 */
static inline vec is_counted(ivec mask) { return choose(mask, splat(1), splat(0)); }
