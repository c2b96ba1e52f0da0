/* Arithmetic on `vec`: LANES numbers side by side, 1, 2, 4 or 8 of them; define LANES above this text.
 *
 * For one lane `vec` is a plain double, else a vector of GCC and Clang. A lane has the same bits for every number of
 * lanes, compiler, level of optimisation and set of instructions, if nothing is contracted (-ffp-contract=off); only
 * the sign and the payload of a NaN are the processor's. Operators take a vec and a literal: 2.0 * x.
 *
 * What stands under "one lane at a time" is the C library's, and its last bits are, too.
 * ulp: unit in the last place of the exact result. The errors stated are those that tests/test_vectors.py allows.
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
#define INSIDE static inline __attribute__((always_inline, unused)) /* part of one other function or two */

/* -- lanes ------------------------------------------------------------------------------------------------------ */

typedef union {
    vec all;
    ivec whole;
    double of[LANES];
    long long whole_of[LANES];
} Lanes;

VECTOR vec splat(double x) {
    Lanes found;
    for (int l = 0; l < LANES; l++) found.of[l] = x;
    return found.all;
}
VECTOR vec load(const double *from) {
    vec found;
    memcpy(&found, from, sizeof found); /* any address will do */
    return found;
}
VECTOR void store(double *to, vec x) { memcpy(to, &x, sizeof x); }
VECTOR double lane(vec x, int l) { return ((Lanes){.all = x}).of[l]; }
VECTOR vec gather(const double *base, const int *index) {
#define AT(l) base[index[l]]
#if LANES == 1
    return AT(0);
#elif LANES == 2
    return (vec){AT(0), AT(1)};
#elif LANES == 4
    return (vec){AT(0), AT(1), AT(2), AT(3)};
#else
    return (vec){AT(0), AT(1), AT(2), AT(3), AT(4), AT(5), AT(6), AT(7)};
#endif
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
VECTOR vec v_fmin(vec a, vec b) { return choose(is_less(a, b) | is_different(b, b), a, b); } /* the one that is no NaN */
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

/* -- one lane at a time, by the C library ------------------------------------------------------------------------ */

EACH_LANE(v_log, log)
EACH_LANE(v_log1p, log1p)
EACH_LANE(v_expm1, expm1)
EACH_LANE(v_asin, asin)
EACH_LANE(v_acos, acos)
EACH_LANE(v_sinh, sinh)
EACH_LANE(v_cosh, cosh)
EACH_LANE(v_asinh, asinh)
EACH_LANE(v_acosh, acosh)
EACH_LANE(v_atanh, atanh)
EACH_LANE(v_erf, erf)
EACH_PAIR(v_pow, pow)
EACH_PAIR(v_hypot, hypot)

/* -- sine, cosine, tangent --------------------------------------------------------------------------------------- */

#define SHIFT 0x1.8p52 /* added to a number below 2^51, it rounds it to an integer, which stands in the last bits */
#define FAR 0x1p20     /* from here on, multiples of parts of pi/2 are not exact */

/* x = quadrant pi/2 + rest - excess */
typedef struct {
    vec rest, excess;
    ivec quadrant;
} Angle;

/* Bits of 2/pi, behind 64 zeros. */
static const unsigned long long two_over_pi[20] = {
    0,
    0xa2f9836e4e441529, 0xfc2757d1f534ddc0, 0xdb6295993c439041, 0xfe5163abdebbc561, 0xb7246e3a424dd2e0,
    0x06492eea09d1921c, 0xfe1deb1cb129a73e, 0xe88235f52ebb4484, 0xe99c7026b45f7e41, 0x3991d639835339f4,
    0x9c845f8bbdf9283b, 0x1ff897ffde05980f, 0xef2f118b5a0a6d1f, 0x6d367ecf27cb09b7, 0x4f463f669e5fea2d,
    0x7527bac7ebe5f17b, 0x3d0739f78a5292ea, 0x6bfb5fb11f8d5d08, 0x56033046fc7b6bab,
};

/* The angle of one number of at least FAR, in integers: |x| = m 2^e, and of m (2/pi) 2^e the bits from 2 on are left
 * out, 190 bits behind the point kept. At most 62 of these vanish next to a multiple of pi/2, and 53 are not certain.
 */
static void far_angle(double x, double *rest, double *excess, long long *quadrant) {
    typedef unsigned long long word;
    typedef unsigned __int128 words;
    word image;
    memcpy(&image, &x, sizeof image);
    int negative = (int)(image >> 63), exponent = (int)(image >> 52 & 0x7ff);
    *rest = x - x, *excess = 0, *quadrant = 0;
    if (exponent == 0x7ff) return; /* NaN */

    word m = (image & 0xfffffffffffff) | 0x10000000000000, window[3];
    int skip = exponent - 1075 - 2 + 64;
    for (int k = 0; k < 3; k++) {
        const word *at = two_over_pi + skip / 64 + k;
        window[k] = (word)(((words)at[0] << 64 | at[1]) >> (64 - skip % 64));
    }
    words low = (words)m * window[2], middle = (words)m * window[1] + (low >> 64);
    word part[3] = {m * window[0] + (word)(middle >> 64), (word)middle, (word)low};

    word nearest = (part[0] + ((word)1 << 61)) >> 62;
    part[0] -= nearest << 62;
    int below = part[0] >> 63 != 0;
    if (below) { /* than the nearest multiple */
        part[0] = ~part[0], part[1] = ~part[1], part[2] = -part[2];
        if (part[2] == 0 && ++part[1] == 0) part[0]++;
    }
    int gone = 0;
    if (part[0] == 0) part[0] = part[1], part[1] = part[2], gone = 64;
    int zeros = __builtin_clzll(part[0]);
    word top = (word)(((words)part[0] << 64 | part[1]) << zeros >> 64);
    words product = (words)top * 0xc90fdaa22168c235; /* pi/2 2^63 */
    word high = (word)(product >> 64), rounded = (high + 0x400) & ~(word)0x7ff;

    double scale = ldexp(below == negative ? 1 : -1, -61 - zeros - gone);
    *rest = (double)rounded * scale;
    *excess = (double)(long long)(rounded - high) * scale;
    *quadrant = negative ? -(long long)nearest : (long long)nearest;
}

INSIDE Angle reduce(vec x) {
    vec shifted = x * 0x1.45f306dc9c883p-1 + SHIFT, k = shifted - SHIFT;
    Angle found = {.quadrant = bits(shifted)};
    vec a = x - k * 0x1.921fb544p+0; /* pi/2 in four parts; up to FAR, multiples of the first three are exact */
    vec part = k * 0x1.0b4611a6p-34, b = a - part;
    vec excess = part - (a - b);
    part = k * 0x1.3198a2ep-69;
    found.rest = b - part;
    found.excess = (part - (b - found.rest)) + excess + k * 0x1.b839a252049c1p-104;

    ivec far = is_less_equal(splat(FAR), v_fabs(x));
    if (any(far)) {
        Lanes rest = {.all = found.rest}, low = {.all = found.excess}, quadrant = {.whole = found.quadrant};
        for (int l = 0; l < LANES; l++)
            if (!(fabs(lane(x, l)) < FAR))
                far_angle(lane(x, l), &rest.of[l], &low.of[l], &quadrant.whole_of[l]);
        found = (Angle){rest.all, low.all, quadrant.whole};
    }
    return found;
}

/* Both within 1 ulp, for every x; infinite: NaN. */
VECTOR void v_sincos(vec x, vec *sine, vec *cosine) {
    Angle angle = reduce(x);
    vec r = angle.rest, z = r * r, half = 0.5 * z;
    vec odd = -0x1.5555555555548p-3 + z * (0x1.111111110f7cbp-7 + z * (-0x1.a01a019bfd3a5p-13
            + z * (0x1.71de35672e55fp-19 + z * (-0x1.ae5e5a09f56f2p-26 + z * 0x1.5d8fa8914e415p-33))));
    vec even = 0x1.555555555554bp-5 + z * (-0x1.6c16c16c14f8bp-10 + z * (0x1.a01a019c839e8p-16
            + z * (-0x1.27e4f7ea3fd83p-22 + z * (0x1.1ee9d75752e0bp-29 + z * -0x1.8fa46803f06fbp-37))));
    vec s = r - (angle.excess - z * r * odd); /* excess, in this order: the sign of 0 stays */
    vec c = 1.0 - (half - (z * z * even + r * angle.excess));

    uvec q = (uvec)angle.quadrant;
    ivec swap = -(angle.quadrant & 1), both = (bits(s) ^ bits(c)) & swap;
    *sine = flip(s, both ^ (ivec)((q & 2) << 62));
    *cosine = flip(c, both ^ (ivec)(((q + 1) & 2) << 62));
}
VECTOR vec v_sin(vec x) {
    vec s, c;
    v_sincos(x, &s, &c);
    return s;
}
VECTOR vec v_cos(vec x) {
    vec s, c;
    v_sincos(x, &s, &c);
    return c;
}
/* Within 2 ulp. */
VECTOR vec v_tan(vec x) {
    vec s, c;
    v_sincos(x, &s, &c);
    return s / c;
}

/* -- arc tangent ------------------------------------------------------------------------------------------------- */

/* Within 2 ulp; signs of 0 and infinite arguments as in C. */
VECTOR vec v_atan2(vec y, vec x) {
    vec up = v_fabs(y), along = v_fabs(x);
    ivec steep = is_less(along, up);
    vec large = choose(steep, up, along);
    ivec huge = is_less_equal(splat(0x1p1000), large), zero = is_equal(large, splat(0));
    if (any(huge | zero)) { /* the ratio overflows, or is none */
        ivec endless = is_equal(large, splat(INFINITY));
        ivec long_up = is_equal(up, splat(INFINITY)), long_along = is_equal(along, splat(INFINITY));
        vec scale = choose(endless, splat(0), choose(huge, splat(0x1p-60), splat(1)));
        up = choose(long_up, splat(1), scale * up);
        along = choose(long_along | zero, splat(1), scale * along);
        large = choose(steep, up, along);
    }
    /* the angle is k pi/4 + arctan of a ratio of at most 1/2 */
    vec small = choose(steep, along, up);
    ivec middle = is_less(0.5 * large, small);
    vec over = choose(middle, up - along, choose(steep, -along, up));
    vec t = over / choose(middle, up + along, large);
    vec k = choose(middle, splat(1), where(steep, splat(2)));
    ivec back = MASK(bits(x) < 0);
    k = choose(back, 4.0 - k, k);
    t = flip(t, sign_bit(x));

    vec z = t * t;
    vec p = -0x1.5555555555552p-2 + z * (0x1.999999999901ep-3 + z * (-0x1.249249244ff4ep-3 + z * (0x1.c71c71a9d89b4p-4
          + z * (-0x1.745d1374689a6p-4 + z * (0x1.3b135eff7da17p-4 + z * (-0x1.110c5ea886adfp-4
          + z * (0x1.e181c09ecab1ep-5 + z * (-0x1.ac6d007713613p-5 + z * (0x1.77e7fe4b7f795p-5
          + z * (-0x1.2feeddde3311ap-5 + z * (0x1.832c45a9a1ed0p-6 + z * -0x1.11a81116de8d6p-7)))))))))));
    vec found = k * 0x1.921fb54442d18p-1 + (t + (k * 0x1.1a62633145c07p-55 + t * z * p));
    return flip(found, sign_bit(y));
}
VECTOR vec v_atan(vec x) { return v_atan2(x, splat(1)); }

/* -- exponentials ------------------------------------------------------------------------------------------------ */

/* 2^k, for an integer k from -1022 to 1023 */
INSIDE vec power_of_two(vec k) { return from_bits((ivec)((uvec)bits(k + SHIFT) << 52) + bits(splat(1))); }

/* exp(x) = 2^k (1 + what is returned) */
INSIDE vec exponential(vec x, vec *k) {
    *k = (x * 0x1.71547652b82fep+0 + SHIFT) - SHIFT;
    vec r = (x - *k * 0x1.62e42fefa38p-1) - *k * 0x1.ef35793c7673p-45;
    vec p = 0.5 + r * (0x1.5555555555559p-3 + r * (0x1.555555555555ap-5 + r * (0x1.111111110f6aep-7
          + r * (0x1.6c16c16c14431p-10 + r * (0x1.a01a01afe5874p-13 + r * (0x1.a01a01b0bf617p-16
          + r * (0x1.71ddf852a53bdp-19 + r * (0x1.27e4c5916d63bp-22 + r * (0x1.af5ec0bd3e3fbp-26
          + r * 0x1.1f9577e18bc36p-29)))))))));
    return r + r * r * p;
}
/* Within 1 ulp, subnormal results too. */
VECTOR vec v_exp(vec x) {
    vec k, bounded = choose(is_less(x, splat(-750)), splat(-750), choose(is_less(splat(750), x), splat(750), x));
    vec e = 1.0 + exponential(bounded, &k);
    vec half = (0.5 * k + SHIFT) - SHIFT; /* 2^k itself need not be a double */
    return e * power_of_two(half) * power_of_two(k - half);
}
/* Within 2.5 ulp. */
VECTOR vec v_tanh(vec x) {
    vec k, size = v_fabs(x), twice = 2.0 * choose(is_less(splat(20), size), splat(20), size);
    vec e = exponential(twice, &k), power = power_of_two(k);
    vec less_one = e * power + (power - 1.0); /* exp(2 |x|) - 1, without cancellation */
    return v_copysign(less_one / (less_one + 2.0), x);
}
