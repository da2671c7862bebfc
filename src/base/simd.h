/* The SIMD vocabulary: four doubles, eight floats. Kernels are written in it once; SIMDe maps it to AVX or to what the
 * machine has, with the same bits: every operation here but f8_madd and f4_madd is exact or correctly rounded (IEEE 754), none is
 * approximate.
 *
 * A comparison gives a lane mask, all bits set where true; it is false where either side is NaN. min and max follow the
 * instruction: min(a, b) is a < b ? a : b and max(a, b) is a > b ? a : b, so b where either is NaN, and where both are
 * zeros. To keep a bound from a NaN, put it second. */
#ifndef KELLER_BASE_SIMD_H
#define KELLER_BASE_SIMD_H

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <math.h>
#include <simde/x86/avx2.h>
#include <simde/x86/fma.h>
#pragma GCC diagnostic pop

/* ---- four doubles ------------------------------------------------------------------------------------------------ */

typedef simde__m256d d4;

static inline d4 d4_set1(double a) { return simde_mm256_set1_pd(a); }
/* Lanes 0 to 3 from left to right. */
static inline d4 d4_set(double a, double b, double c, double d) { return simde_mm256_set_pd(d, c, b, a); }
/* Four doubles at any address. */
static inline d4 d4_load(const double *p) { return simde_mm256_loadu_pd(p); }
static inline void d4_store(double *p, d4 a) { simde_mm256_storeu_pd(p, a); }
/* Rounded to single precision; 4 floats. */
static inline void d4_store_floats(float *p, d4 a) { simde_mm_storeu_ps(p, simde_mm256_cvtpd_ps(a)); }
static inline double d4_first(d4 a) { return simde_mm256_cvtsd_f64(a); }

static inline d4 d4_add(d4 a, d4 b) { return simde_mm256_add_pd(a, b); }
static inline d4 d4_sub(d4 a, d4 b) { return simde_mm256_sub_pd(a, b); }
static inline d4 d4_mul(d4 a, d4 b) { return simde_mm256_mul_pd(a, b); }
static inline d4 d4_div(d4 a, d4 b) { return simde_mm256_div_pd(a, b); }
static inline d4 d4_sqrt(d4 a) { return simde_mm256_sqrt_pd(a); }
static inline d4 d4_min(d4 a, d4 b) { return simde_mm256_min_pd(a, b); }
static inline d4 d4_max(d4 a, d4 b) { return simde_mm256_max_pd(a, b); }
static inline d4 d4_abs(d4 a) { return simde_mm256_andnot_pd(simde_mm256_set1_pd(-0.0), a); }
static inline d4 d4_neg(d4 a) { return simde_mm256_xor_pd(simde_mm256_set1_pd(-0.0), a); }

static inline d4 d4_lt(d4 a, d4 b) { return simde_mm256_cmp_pd(a, b, SIMDE_CMP_LT_OQ); }
static inline d4 d4_le(d4 a, d4 b) { return simde_mm256_cmp_pd(a, b, SIMDE_CMP_LE_OQ); }
static inline d4 d4_and(d4 a, d4 b) { return simde_mm256_and_pd(a, b); }
static inline d4 d4_or(d4 a, d4 b) { return simde_mm256_or_pd(a, b); }
static inline d4 d4_xor(d4 a, d4 b) { return simde_mm256_xor_pd(a, b); }
/* mask ? a : b */
static inline d4 d4_blend(d4 mask, d4 a, d4 b) { return simde_mm256_blendv_pd(b, a, mask); }
/* Bit i is set where lane i of the comparison is true. */
static inline int d4_mask(d4 a) { return simde_mm256_movemask_pd(a); }

/* a b - product, for product = a b rounded: exact unless it over- or underflows. */
static inline d4 d4_product_error(d4 a, d4 b, d4 product)
{
#ifdef SIMDE_X86_FMA_NATIVE
    return simde_mm256_fmsub_pd(a, b, product);
#else /* SIMDe's own form may round twice */
    double x[4], y[4], z[4];
    d4_store(x, a), d4_store(y, b), d4_store(z, product);
    return d4_set(fma(x[0], y[0], -z[0]), fma(x[1], y[1], -z[1]), fma(x[2], y[2], -z[2]), fma(x[3], y[3], -z[3]));
#endif
}

/* Lanes (i, j, k, l) of a; i to l are constants, 0 to 3. */
#define d4_permute(a, i, j, k, l) simde_mm256_permute4x64_pd((a), (i) | (j) << 2 | (k) << 4 | (l) << 6)
/* The corners of a triangle, one further and two further: lanes (1, 2, 0, 1) and (2, 0, 1, 2). */
static inline d4 d4_rotate(d4 a) { return d4_permute(a, 1, 2, 0, 1); }
static inline d4 d4_rotate2(d4 a) { return d4_permute(a, 2, 0, 1, 2); }
/* The least and the greatest of the four lanes, none of them NaN. */
static inline double d4_hmin(d4 a)
{
    d4 b = d4_min(a, d4_permute(a, 2, 3, 0, 1));
    return d4_first(d4_min(b, simde_mm256_permute_pd(b, 5)));
}
static inline double d4_hmax(d4 a)
{
    d4 b = d4_max(a, d4_permute(a, 2, 3, 0, 1));
    return d4_first(d4_max(b, simde_mm256_permute_pd(b, 5)));
}

/* ---- eight floats ------------------------------------------------------------------------------------------------ */

typedef simde__m256 f8;

static inline f8 f8_set1(float a) { return simde_mm256_set1_ps(a); }
/* 32-byte aligned. */
static inline f8 f8_load(const float *p) { return simde_mm256_load_ps(p); }
/* Lanes 0 to 7 from left to right. */
static inline f8 f8_set(float a, float b, float c, float d, float e, float f, float g, float h)
{
    return simde_mm256_set_ps(h, g, f, e, d, c, b, a);
}
static inline void f8_store(float *p, f8 a) { simde_mm256_store_ps(p, a); }

static inline f8 f8_add(f8 a, f8 b) { return simde_mm256_add_ps(a, b); }
static inline f8 f8_sub(f8 a, f8 b) { return simde_mm256_sub_ps(a, b); }
static inline f8 f8_mul(f8 a, f8 b) { return simde_mm256_mul_ps(a, b); }
static inline f8 f8_div(f8 a, f8 b) { return simde_mm256_div_ps(a, b); }
/* a b + c, rounded once or, where the machine has no such instruction, twice: for bounds that allow for either. */
static inline f8 f8_madd(f8 a, f8 b, f8 c) { return simde_mm256_fmadd_ps(a, b, c); }
static inline f8 f8_sqrt(f8 a) { return simde_mm256_sqrt_ps(a); }
static inline f8 f8_min(f8 a, f8 b) { return simde_mm256_min_ps(a, b); }
static inline f8 f8_max(f8 a, f8 b) { return simde_mm256_max_ps(a, b); }
static inline f8 f8_abs(f8 a) { return simde_mm256_andnot_ps(simde_mm256_set1_ps(-0.0f), a); }
static inline f8 f8_neg(f8 a) { return simde_mm256_xor_ps(simde_mm256_set1_ps(-0.0f), a); }

static inline f8 f8_lt(f8 a, f8 b) { return simde_mm256_cmp_ps(a, b, SIMDE_CMP_LT_OQ); }
static inline f8 f8_le(f8 a, f8 b) { return simde_mm256_cmp_ps(a, b, SIMDE_CMP_LE_OQ); }
static inline f8 f8_and(f8 a, f8 b) { return simde_mm256_and_ps(a, b); }
static inline f8 f8_or(f8 a, f8 b) { return simde_mm256_or_ps(a, b); }
static inline f8 f8_xor(f8 a, f8 b) { return simde_mm256_xor_ps(a, b); }
/* not a, and b */
static inline f8 f8_andnot(f8 a, f8 b) { return simde_mm256_andnot_ps(a, b); }
/* mask ? a : b */
static inline f8 f8_blend(f8 mask, f8 a, f8 b) { return simde_mm256_blendv_ps(b, a, mask); }
static inline int f8_mask(f8 a) { return simde_mm256_movemask_ps(a); }

/* Bit i is set where the unsigned integer p[i] is `value`; 32-byte aligned. */
static inline int i8_equal(const uint32_t p[8], uint32_t value)
{
    simde__m256i all = simde_mm256_load_si256((const simde__m256i *)p);
    return simde_mm256_movemask_ps(simde_mm256_castsi256_ps(simde_mm256_cmpeq_epi32(all, simde_mm256_set1_epi32((int32_t)value))));
}

/* A mask for f8_blend and f8_mask: lane i is chosen where bit 31 - k of p[i] is set; 32-byte aligned. */
static inline f8 f8_chosen(const uint32_t p[8], int k)
{
    return simde_mm256_castsi256_ps(simde_mm256_slli_epi32(simde_mm256_load_si256((const simde__m256i *)p), k));
}

/* ---- four floats, four integers: points and boxes ----------------------------------------------------------------- */

typedef simde__m128 f4;
typedef simde__m128i i4;

static inline f4 f4_set1(float a) { return simde_mm_set1_ps(a); }
/* Lanes 0 to 3 from left to right. */
static inline f4 f4_set(float a, float b, float c, float d) { return simde_mm_set_ps(d, c, b, a); }
/* Any alignment. */
static inline f4 f4_load(const float *p) { return simde_mm_loadu_ps(p); }
static inline void f4_store(float *p, f4 a) { simde_mm_storeu_ps(p, a); }
/* Lanes 0 to 3, and 4 to 7, of eight. */
static inline f4 f4_low(f8 a) { return simde_mm256_castps256_ps128(a); }
static inline f4 f4_high(f8 a) { return simde_mm256_extractf128_ps(a, 1); }
/* The inverse: low before high. */
static inline f8 f8_join(f4 low, f4 high) { return simde_mm256_insertf128_ps(simde_mm256_castps128_ps256(low), high, 1); }
static inline f8 f8_twice(f4 a) { return f8_join(a, a); }
/* Lane i four times, then lane i + 1 four times. */
static inline f8 f8_four_each(f4 a, int i)
{
    return simde_mm256_permutevar8x32_ps(simde_mm256_castps128_ps256(a), simde_mm256_set_epi32(i + 1, i + 1, i + 1, i + 1, i, i, i, i));
}

static inline f4 f4_add(f4 a, f4 b) { return simde_mm_add_ps(a, b); }
static inline f4 f4_sub(f4 a, f4 b) { return simde_mm_sub_ps(a, b); }
static inline f4 f4_mul(f4 a, f4 b) { return simde_mm_mul_ps(a, b); }
static inline f4 f4_div(f4 a, f4 b) { return simde_mm_div_ps(a, b); }
static inline f4 f4_madd(f4 a, f4 b, f4 c) { return simde_mm_fmadd_ps(a, b, c); }
static inline f4 f4_sqrt(f4 a) { return simde_mm_sqrt_ps(a); }
static inline f4 f4_abs(f4 a) { return simde_mm_andnot_ps(simde_mm_set1_ps(-0.0f), a); }
static inline f4 f4_min(f4 a, f4 b) { return simde_mm_min_ps(a, b); }
static inline f4 f4_max(f4 a, f4 b) { return simde_mm_max_ps(a, b); }
static inline f4 f4_floor(f4 a) { return simde_mm_floor_ps(a); }
static inline f4 f4_neg(f4 a) { return simde_mm_xor_ps(simde_mm_set1_ps(-0.0f), a); }

static inline f4 f4_lt(f4 a, f4 b) { return simde_mm_cmplt_ps(a, b); }
static inline f4 f4_le(f4 a, f4 b) { return simde_mm_cmple_ps(a, b); }
static inline f4 f4_and(f4 a, f4 b) { return simde_mm_and_ps(a, b); }
static inline f4 f4_xor(f4 a, f4 b) { return simde_mm_xor_ps(a, b); }
/* mask ? a : b */
static inline f4 f4_blend(f4 mask, f4 a, f4 b) { return simde_mm_blendv_ps(b, a, mask); }
static inline int f4_mask(f4 a) { return simde_mm_movemask_ps(a); }
/* The columns (x, y, z) of the rows a, b, c: lanes 0 to 2; lane 3 is of no use. */
static inline void f4_columns(f4 a, f4 b, f4 c, f4 column[3])
{
    f4 low = simde_mm_unpacklo_ps(a, b), high = simde_mm_unpackhi_ps(a, b);
    column[0] = simde_mm_movelh_ps(low, c);
    column[1] = simde_mm_shuffle_ps(low, c, SIMDE_MM_SHUFFLE(3, 1, 3, 2));
    column[2] = simde_mm_shuffle_ps(high, c, SIMDE_MM_SHUFFLE(3, 2, 1, 0));
}

/* i8_equal for four. */
static inline int i4_equal(const uint32_t p[4], uint32_t value)
{
    simde__m128i all = simde_mm_load_si128((const simde__m128i *)p);
    return simde_mm_movemask_ps(simde_mm_castsi128_ps(simde_mm_cmpeq_epi32(all, simde_mm_set1_epi32((int32_t)value))));
}

/* f8_chosen for four. */
static inline f4 f4_chosen(const uint32_t p[4], int k)
{
    return simde_mm_castsi128_ps(simde_mm_slli_epi32(simde_mm_load_si128((const simde__m128i *)p), k));
}

static inline i4 i4_set1(int32_t a) { return simde_mm_set1_epi32(a); }
static inline i4 i4_load(const int32_t *p) { return simde_mm_loadu_si128((const simde__m128i *)p); }
static inline void i4_store(int32_t *p, i4 a) { simde_mm_storeu_si128((simde__m128i *)p, a); }
static inline i4 i4_add(i4 a, i4 b) { return simde_mm_add_epi32(a, b); }
static inline i4 i4_sub(i4 a, i4 b) { return simde_mm_sub_epi32(a, b); }
static inline i4 i4_and(i4 a, i4 b) { return simde_mm_and_si128(a, b); }
static inline i4 i4_gt(i4 a, i4 b) { return simde_mm_cmpgt_epi32(a, b); }
/* The nearest floats; towards zero (below 2^31 in size); the bits as they are. */
static inline f4 i4_to_f4(i4 a) { return simde_mm_cvtepi32_ps(a); }
static inline i4 f4_to_i4(f4 a) { return simde_mm_cvttps_epi32(a); }
static inline f4 i4_as_f4(i4 a) { return simde_mm_castsi128_ps(a); }

#endif
