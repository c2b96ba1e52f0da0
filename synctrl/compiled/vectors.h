/* Arithmetic on `vec`: LANES numbers side by side, 1, 2, 4 or 8 of them; define LANES above this text.
 *
 * For one lane `vec` is a plain double, else a vector of GCC and Clang. A lane has the same bits for every number of
 * lanes, compiler, level of optimisation and set of instructions, if nothing is contracted (-ffp-contract=off); only
 * the sign and the payload of a NaN are the processor's. Operators take a vec and a literal: 2.0 * x.
 *
 * Everything here is exact, or rounded correctly. Functions that are neither are in elementary.h.
 */

#include <math.h>
#include <string.h>

#if LANES == 1
typedef double vec;
typedef long long ivec;
typedef unsigned long long uvec;
#define MASK(condition) (-(ivec)(condition))
#else
typedef double vec __attribute__((vector_size(8 * LANES)));
typedef long long ivec __attribute__((vector_size(8 * LANES)));
typedef unsigned long long uvec __attribute__((vector_size(8 * LANES)));
#define MASK(condition) ((ivec)(condition))
#endif

#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wpsabi" /* how wide vectors are handed over matters to nobody outside of one file */
#endif

#define VECTOR static inline __attribute__((unused))

/* -- lanes ------------------------------------------------------------------------------------------------------ */

typedef union {
    vec all;
    ivec whole;
    double of[LANES];
    long long whole_of[LANES];
} Lanes;

VECTOR vec splat(double x) { return x - (vec){0}; } /* -0 stays -0 */
VECTOR vec load(const double *from) {
    vec found;
    memcpy(&found, from, sizeof found); /* any address will do */
    return found;
}
VECTOR void store(double *to, vec x) { memcpy(to, &x, sizeof x); }
VECTOR double lane(vec x, int l) { return ((Lanes){.all = x}).of[l]; }
VECTOR vec gather(const double *base, const int *index) { /* written out: a loop would go through memory */
#define FOUND(l) base[index[l]]
#if LANES == 1
    return FOUND(0);
#elif LANES == 2
    return (vec){FOUND(0), FOUND(1)};
#elif LANES == 4
    return (vec){FOUND(0), FOUND(1), FOUND(2), FOUND(3)};
#else
    return (vec){FOUND(0), FOUND(1), FOUND(2), FOUND(3), FOUND(4), FOUND(5), FOUND(6), FOUND(7)};
#endif
#undef FOUND
}

/* Lanes of x, those with these numbers: as `gather` of x alone, in one register. */
VECTOR vec permuted(vec x, const int *index) {
#if LANES > 1 && !defined(__clang__)
    typedef int narrow __attribute__((vector_size(4 * LANES)));
    narrow found;
    memcpy(&found, index, sizeof found);
    return __builtin_shuffle(x, __builtin_convertvector(found, ivec));
#else
    return gather((const double *)&x, index);
#endif
}

/* Every LANES-th number from one on. */
VECTOR vec strided(const double *from) {
#define NEXT(l) from[l * LANES]
#if LANES == 1
    return NEXT(0);
#elif LANES == 2
    return (vec){NEXT(0), NEXT(1)};
#elif LANES == 4
    return (vec){NEXT(0), NEXT(1), NEXT(2), NEXT(3)};
#else
    return (vec){NEXT(0), NEXT(1), NEXT(2), NEXT(3), NEXT(4), NEXT(5), NEXT(6), NEXT(7)};
#endif
#undef NEXT
}

/* -- masks: all bits of a lane, or none -------------------------------------------------------------------------- */

VECTOR ivec bits(vec x) { return ((Lanes){.all = x}).whole; }
VECTOR vec from_bits(ivec x) { return ((Lanes){.whole = x}).all; }

VECTOR ivec is_less(vec a, vec b) { return MASK(a < b); }
VECTOR ivec is_less_equal(vec a, vec b) { return MASK(a <= b); }
VECTOR ivec is_equal(vec a, vec b) { return MASK(a == b); }
VECTOR ivec is_different(vec a, vec b) { return MASK(a != b); }

VECTOR int any(ivec mask) {
    Lanes m = {.whole = mask};
    long long found = 0;
    for (int l = 0; l < LANES; l++) found |= m.whole_of[l];
    return found != 0;
}
VECTOR vec where(ivec mask, vec x) { return from_bits(mask & bits(x)); } /* x, or 0 */
VECTOR vec choose(ivec mask, vec a, vec b) {
#if LANES == 1
    return mask ? a : b;
#else
    return from_bits((mask & bits(a)) | (~mask & bits(b)));
#endif
}

/* -- exact operations; truth is a number as in CasADi: 1 or 0, and what differs from 0 is true ------------------- */

VECTOR vec v_lt(vec a, vec b) { return where(is_less(a, b), splat(1)); }
VECTOR vec v_le(vec a, vec b) { return where(is_less_equal(a, b), splat(1)); }
VECTOR vec v_eq(vec a, vec b) { return where(is_equal(a, b), splat(1)); }
VECTOR vec v_ne(vec a, vec b) { return where(is_different(a, b), splat(1)); }
VECTOR vec v_not(vec a) { return v_eq(a, splat(0)); }
VECTOR vec v_and(vec a, vec b) {
    return where(is_different(a, splat(0)) & is_different(b, splat(0)), splat(1));
}
VECTOR vec v_or(vec a, vec b) {
    return where(is_different(a, splat(0)) | is_different(b, splat(0)), splat(1));
}
VECTOR vec v_if_else_zero(vec c, vec x) { return where(is_different(c, splat(0)), x); }

VECTOR ivec sign_bit(vec x) { return bits(x) & bits(splat(-0.0)); }
VECTOR vec flip(vec x, ivec sign) { return from_bits(bits(x) ^ sign); }
VECTOR vec v_fabs(vec x) { return flip(x, sign_bit(x)); }
VECTOR vec v_copysign(vec x, vec sign) { return flip(v_fabs(x), sign_bit(sign)); }
VECTOR vec v_sign(vec x) { /* of 0 and NaN: themselves */
    return choose(is_less(splat(0), v_fabs(x)), v_copysign(splat(1), x), x);
}
/* of a NaN and a number, the number */
VECTOR vec v_fmin(vec a, vec b) { return choose(is_less(a, b) | is_different(b, b), a, b); }
VECTOR vec v_fmax(vec a, vec b) { return choose(is_less(b, a) | is_different(b, b), a, b); }
VECTOR vec v_sq(vec x) { return x * x; }
VECTOR vec v_twice(vec x) { return 2.0 * x; }
VECTOR vec v_inv(vec x) { return 1.0 / x; }

#define EACH_LANE(name, function)                                        \
    VECTOR vec name(vec x) {                                             \
        Lanes found = {.all = x};                                        \
        for (int l = 0; l < LANES; l++) found.of[l] = function(found.of[l]); \
        return found.all;                                                \
    }
#define EACH_PAIR(name, function)                                                        \
    VECTOR vec name(vec x, vec y) {                                                      \
        Lanes found = {.all = x}, with = {.all = y};                                     \
        for (int l = 0; l < LANES; l++) found.of[l] = function(found.of[l], with.of[l]); \
        return found.all;                                                                \
    }
EACH_LANE(v_sqrt, sqrt) /* compilers make one instruction of each of these three */
EACH_LANE(v_floor, floor)
EACH_LANE(v_ceil, ceil)
EACH_PAIR(v_fmod, fmod)
EACH_PAIR(v_remainder, remainder)
