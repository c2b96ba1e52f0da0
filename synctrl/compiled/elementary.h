/* Elementary functions of lanes of numbers; vectors.h stands above this text.
 *
 * Those of the first parts are made of + - * /, square roots and integers alone: the same bits everywhere. Those of the
 * last part are the C library's, one lane at a time: their last bits depend on it.
 *
 * ulp: unit in the last place of the exact result. The errors stated are those that tests/test_vectors.py allows; they
 * hold for every double. Where C has a number for 0, infinite numbers and NaN, it is that one, with its sign.
 * The polynomials have the least relative errors of their degrees: `scripts/polynomials.py` prints them.
 */

#define INSIDE static inline __attribute__((always_inline, unused)) /* part of other functions */

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

typedef unsigned long long Word;
typedef unsigned __int128 Words;

/* (2/pi) m 2^e modulo 4, in units of 2^-190.
 *
 * Bits of 2/pi that make multiples of 4 are passed over, and the next 192 are taken. Of the result, the last 53 bits
 * are not certain, and next to an integer as many as 62 say nothing: 75 are left.
 */
static __attribute__((unused)) void quarters(Word m, int e, Word found[3]) {
    int first = 64 + e - 2;
    Word taken[3];
    for (int k = 0; k < 3; k++) {
        const Word *at = two_over_pi + first / 64 + k;
        taken[k] = (Word)(((Words)at[0] << 64 | at[1]) >> (64 - first % 64));
    }
    Words low = (Words)m * taken[2], middle = (Words)m * taken[1] + (low >> 64);
    found[0] = m * taken[0] + (Word)(middle >> 64), found[1] = (Word)middle, found[2] = (Word)low;
}

/* The angle of one number of at least FAR, in integers. */
static __attribute__((unused)) void far_angle(double x, double *rest, double *excess, long long *quadrant) {
    Word image, part[3];
    memcpy(&image, &x, sizeof image);
    int negative = (int)(image >> 63), exponent = (int)(image >> 52 & 0x7ff);
    *rest = x - x, *excess = 0, *quadrant = 0;
    if (exponent == 0x7ff) return; /* NaN */
    quarters((image & 0xfffffffffffff) | 0x10000000000000, exponent - 1075, part);

    Word nearest = (part[0] + ((Word)1 << 61)) >> 62;
    part[0] -= nearest << 62;
    int below = part[0] >> 63 != 0;
    if (below) { /* the nearest integer: change the sign */
        part[0] = ~part[0], part[1] = ~part[1], part[2] = -part[2];
        if (part[2] == 0 && ++part[1] == 0) part[0]++;
    }
    int zeros = __builtin_clzll(part[0]); /* it is not 0: no double is that close to a multiple of pi/2 */
    Word top = (Word)(((Words)part[0] << 64 | part[1]) << zeros >> 64);
    Word product = (Word)((Words)top * 0xc90fdaa22168c235 >> 64); /* by 2^63 pi/2; its first 53 bits, and the others: */
    Word rounded = (product + 0x400) & ~(Word)0x7ff;

    double unit = ldexp(below == negative ? 1 : -1, -61 - zeros);
    *rest = (double)rounded * unit;
    *excess = (double)(long long)(rounded - product) * unit;
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

/* Sine and cosine of rest - excess, and what is to be added to them after rounding. */
typedef struct {
    vec sine, cosine, sine_rest, cosine_rest;
} Circle;

INSIDE Circle circle(Angle angle) {
    vec r = angle.rest, z = r * r, w = z * z;
    vec odd = (-0x1.5555555555548p-3 + z * 0x1.111111110f7cbp-7) + w * ((-0x1.a01a019bfd3a5p-13
            + z * 0x1.71de35672e55fp-19) + w * (-0x1.ae5e5a09f56f2p-26 + z * 0x1.5d8fa8914e415p-33));
    vec even = (0x1.555555555554bp-5 + z * -0x1.6c16c16c14f8bp-10) + w * ((0x1.a01a019c839e8p-16
             + z * -0x1.27e4f7ea3fd83p-22) + w * (0x1.1ee9d75752e0bp-29 + z * -0x1.8fa46803f06fbp-37));
    vec near_1 = 1.0 - 0.5 * z, below = angle.excess * near_1 - z * r * odd; /* in this order -0 stays */
    vec above = ((1.0 - near_1) - 0.5 * z) + (w * even + r * angle.excess);
    vec sine = r - below, cosine = near_1 + above;
    return (Circle){sine, cosine, (r - sine) - below, (near_1 - cosine) + above};
}

/* Both within 1 ulp. */
VECTOR void v_sincos(vec x, vec *sine, vec *cosine) {
    Angle angle = reduce(x);
    Circle at = circle(angle);
    uvec q = (uvec)angle.quadrant;
    ivec swap = -(angle.quadrant & 1), both = (bits(at.sine) ^ bits(at.cosine)) & swap;
    *sine = flip(at.sine, both ^ (ivec)((q & 2) << 62));
    *cosine = flip(at.cosine, both ^ (ivec)(((q + 1) & 2) << 62));
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
    Angle angle = reduce(x);
    Circle at = circle(angle);
    ivec turned = -(angle.quadrant & 1);
    vec up = choose(turned, -at.cosine, at.sine), along = choose(turned, at.sine, at.cosine);
    vec up_rest = choose(turned, -at.cosine_rest, at.sine_rest);
    vec along_rest = choose(turned, at.sine_rest, at.cosine_rest);
    vec found = up / along;
    return choose(is_equal(x, splat(0)), x, found + (up_rest - found * along_rest) / along);
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

    vec z = t * t, w = z * z;
    vec p = (-0x1.5555555555552p-2 + z * 0x1.999999999901ep-3) + w * ((-0x1.249249244ff4ep-3 + z * 0x1.c71c71a9d89b4p-4)
          + w * ((-0x1.745d1374689a6p-4 + z * 0x1.3b135eff7da17p-4) + w * ((-0x1.110c5ea886adfp-4
          + z * 0x1.e181c09ecab1ep-5) + w * ((-0x1.ac6d007713613p-5 + z * 0x1.77e7fe4b7f795p-5)
          + w * ((-0x1.2feeddde3311ap-5 + z * 0x1.832c45a9a1ed0p-6) + w * -0x1.11a81116de8d6p-7)))));
    vec found = k * 0x1.921fb54442d18p-1 + (t + (k * 0x1.1a62633145c07p-55 + t * z * p));
    return flip(found, sign_bit(y));
}
VECTOR vec v_atan(vec x) { return v_atan2(x, splat(1)); }
/* Within 2.5 ulp. */
VECTOR vec v_asin(vec x) { return v_atan2(x, v_sqrt((1.0 - x) * (1.0 + x))); }
VECTOR vec v_acos(vec x) { return v_atan2(v_sqrt((1.0 - x) * (1.0 + x)), x); }

/* Within 2.5 ulp; never beyond the range of numbers on the way. */
VECTOR vec v_hypot(vec x, vec y) {
    vec up = v_fabs(y), along = v_fabs(x);
    ivec steep = is_less(along, up);
    vec large = choose(steep, up, along), t = choose(steep, along, up) / large;
    ivec endless = is_equal(up, splat(INFINITY)) | is_equal(along, splat(INFINITY));
    vec found = choose(is_equal(up + along, splat(0)), splat(0), large * v_sqrt(1.0 + t * t));
    return choose(endless, splat(INFINITY), found);
}

/* -- exponentials ------------------------------------------------------------------------------------------------ */

/* 2^k, for an integer k from -1022 to 1023 */
INSIDE vec power_of_two(vec k) { return from_bits((ivec)((uvec)bits(k + SHIFT) << 52) + bits(splat(1))); }

/* x 2^k, where 2^k itself need not be a double; it is rounded once, so x must be one with |x| near 1 or above */
INSIDE vec scaled(vec x, vec k) {
    vec half = (0.5 * k + SHIFT) - SHIFT;
    return x * power_of_two(half) * power_of_two(k - half);
}

INSIDE vec clamp(vec x, double lowest, double highest) {
    return choose(is_less(x, splat(lowest)), splat(lowest), choose(is_less(splat(highest), x), splat(highest), x));
}

/* exp(x) = 2^k (1 + what is returned) */
INSIDE vec exponential(vec x, vec *k) {
    *k = (x * 0x1.71547652b82fep+0 + SHIFT) - SHIFT;
    vec a = x - *k * 0x1.62e42fefa38p-1, part = *k * 0x1.ef35793c7673p-45; /* log(2) in two parts */
    vec r = a - part, excess = part - (a - r);
    vec w = r * r;
    vec p = (0.5 + r * 0x1.5555555555559p-3) + w * ((0x1.555555555555ap-5 + r * 0x1.111111110f6aep-7)
          + w * ((0x1.6c16c16c14431p-10 + r * 0x1.a01a01afe5874p-13) + w * ((0x1.a01a01b0bf617p-16
          + r * 0x1.71ddf852a53bdp-19) + w * ((0x1.27e4c5916d63bp-22 + r * 0x1.af5ec0bd3e3fbp-26)
          + w * 0x1.1f9577e18bc36p-29))));
    return r + (w * p - excess);
}

/* Within 1 ulp, subnormal results too. */
VECTOR vec v_exp(vec x) {
    vec k, e = exponential(clamp(x, -750, 750), &k);
    return scaled(1.0 + e, k);
}

/* (exp(x) - 1) 2^more, without cancellation */
INSIDE vec less_one(vec x, double more) {
    vec k, e = exponential(clamp(x, -50, 750), &k), bounded = clamp(-k, -100, 100);
    return scaled(e + (1.0 - power_of_two(bounded)), k + more);
}
/* Within 2 ulp. */
VECTOR vec v_expm1(vec x) { return v_copysign(less_one(x, 0), x); }

/* Within 2.5 ulp. */
VECTOR vec v_sinh(vec x) {
    vec size = v_fabs(x), half = less_one(size, -1); /* of exp(|x|) - 1 */
    vec found = choose(is_less(splat(0x1p60), half), half, half + half / (2.0 * half + 1.0));
    return v_copysign(choose(is_less(size, splat(0x1p-28)), size, found), x);
}

/* Within 2 ulp. */
VECTOR vec v_cosh(vec x) {
    vec k, e = exponential(clamp(v_fabs(x), 0, 750), &k);
    vec half = scaled(1.0 + e, k - 1.0); /* of exp(|x|) */
    return half + 0.25 / half;
}

/* Within 2.5 ulp. */
VECTOR vec v_tanh(vec x) {
    vec k, e = exponential(2.0 * clamp(v_fabs(x), 0, 20), &k), power = power_of_two(k);
    vec grown = e * power + (power - 1.0); /* exp(2 |x|) - 1 */
    return v_copysign(grown / (grown + 2.0), x);
}

/* -- logarithms -------------------------------------------------------------------------------------------------- */

/* Within 1 ulp. */
VECTOR vec v_log(vec x) {
    ivec subnormal = is_less(x, splat(0x1p-1022));
    vec normal = choose(subnormal, x * 0x1p54, x);
    /* normal = 2^k (1 + f) with 1 + f from sqrt(1/2) to sqrt(2), by its bits */
    uvec image = (uvec)bits(normal) - (uvec)bits(splat(0x1.6a09e667f3bcdp-1)) + (uvec)bits(splat(1));
    vec k = from_bits((ivec)(image >> 52) | bits(splat(0x1p52))) - (0x1p52 + 1023) - where(subnormal, splat(54));
    vec f = from_bits((ivec)(image & 0xfffffffffffff) + bits(splat(0x1.6a09e667f3bcdp-1))) - 1.0;
    /* log(1 + f) = 2 artanh(s) = f - f f / 2 + s (f f / 2 + z p) */
    vec s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f;
    vec p = (0x1.5555555555592p-1 + z * 0x1.999999997fd72p-2) + w * ((0x1.24924941f5294p-2 + z * 0x1.c71c5205ec95fp-3)
          + w * ((0x1.74663fa755604p-3 + z * 0x1.39a1a66908ec3p-3) + w * 0x1.2f063acc1e8p-3));
    vec found = k * 0x1.62e42fefa38p-1 - ((half - (s * (half + z * p) + k * 0x1.ef35793c7673p-45)) - f);
    if (any(~(is_less(splat(0), x) & is_less(x, splat(INFINITY))))) {
        found = choose(is_less(x, splat(INFINITY)), found, x);
        found = choose(is_equal(x, splat(0)), splat(-INFINITY), choose(is_less(x, splat(0)), splat(NAN), found));
    }
    return found;
}

/* Within 2 ulp. */
VECTOR vec v_log1p(vec x) {
    vec sum = 1.0 + x, taken = sum - 1.0;
    vec rest = (1.0 - (sum - taken)) + (x - taken); /* of rounding the sum */
    ivec ordinary = is_less(splat(0), sum) & is_less(sum, splat(INFINITY));
    return v_copysign(v_log(sum) + where(ordinary, rest / sum), x);
}

/* -- one lane at a time, by the C library ------------------------------------------------------------------------ */

EACH_LANE(v_asinh, asinh)
EACH_LANE(v_acosh, acosh)
EACH_LANE(v_atanh, atanh)
EACH_LANE(v_erf, erf)
EACH_PAIR(v_pow, pow)
