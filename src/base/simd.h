/* The SIMD vocabulary: four doubles. Kernels are written in it once; SIMDe maps it to AVX or to what the machine has. */
#ifndef KELLER_BASE_SIMD_H
#define KELLER_BASE_SIMD_H

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <simde/x86/avx2.h>
#pragma GCC diagnostic pop

typedef simde__m256d d4;

static inline d4 d4_set1(double a) { return simde_mm256_set1_pd(a); }
/* Four floats, 16-byte aligned, widened exactly. */
static inline d4 d4_load_floats(const float *p) { return simde_mm256_cvtps_pd(simde_mm_load_ps(p)); }
static inline d4 d4_add(d4 a, d4 b) { return simde_mm256_add_pd(a, b); }
static inline d4 d4_sub(d4 a, d4 b) { return simde_mm256_sub_pd(a, b); }
static inline d4 d4_mul(d4 a, d4 b) { return simde_mm256_mul_pd(a, b); }
static inline d4 d4_div(d4 a, d4 b) { return simde_mm256_div_pd(a, b); }
static inline d4 d4_sqrt(d4 a) { return simde_mm256_sqrt_pd(a); }
static inline d4 d4_min(d4 a, d4 b) { return simde_mm256_min_pd(a, b); }
static inline d4 d4_max(d4 a, d4 b) { return simde_mm256_max_pd(a, b); }
static inline d4 d4_abs(d4 a) { return simde_mm256_andnot_pd(simde_mm256_set1_pd(-0.0), a); }
static inline d4 d4_le(d4 a, d4 b) { return simde_mm256_cmp_pd(a, b, SIMDE_CMP_LE_OQ); }
static inline d4 d4_and(d4 a, d4 b) { return simde_mm256_and_pd(a, b); }
/* Bit i is set where lane i of the comparison is true. */
static inline int d4_mask(d4 a) { return simde_mm256_movemask_pd(a); }
static inline void d4_store(double *p, d4 a) { simde_mm256_storeu_pd(p, a); }

#endif
