// Functions of Eight on the host. Included in namespace fathom (math/eight.hpp), and once per instruction set by code
// that is compiled for several: inlined from code for another one, a comparison keeps that one's kind of mask.

inline Eight eight(float x) { return Eight{x, x, x, x, x, x, x, x}; }
inline EightInts eight(std::int32_t x) { return EightInts{x, x, x, x, x, x, x, x}; }
inline const Eight& eight(const float* aligned) { return *reinterpret_cast<const Eight*>(aligned); }

/// a·b + c with one rounding.
inline Eight fma(Eight a, Eight b, Eight c) {
#if defined(__FMA__)
  return (Eight)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c);
#else
  for (int i = 0; i < 8; ++i) c[i] = fathom::fma(a[i], b[i], c[i]);
  return c;
#endif
}
inline Eight min(Eight a, Eight b) { return a < b ? a : b; }
inline EightInts min(EightInts a, EightInts b) { return a < b ? a : b; }
inline Eight max(Eight a, Eight b) { return a > b ? a : b; }
inline Eight abs(Eight a) { return (Eight)((EightInts)a & 0x7fffffff); }
/// Correctly rounded square root.
inline Eight sqrt(Eight a) {
#if defined(__FMA__)
  return (Eight)_mm256_sqrt_ps((__m256)a);
#else
  for (int i = 0; i < 8; ++i) a[i] = fathom::sqrt(a[i]);
  return a;
#endif
}
inline Eight select(EightInts mask, Eight a, Eight b) { return mask ? a : b; }
inline EightInts select(EightInts mask, EightInts a, EightInts b) { return mask ? a : b; }

/// 0, 1, …, 7.
inline EightInts lane_numbers() { return EightInts{0, 1, 2, 3, 4, 5, 6, 7}; }

/// A bit for each lane that is true.
inline unsigned bits(EightInts mask) {
#if defined(__FMA__)
  return static_cast<unsigned>(_mm256_movemask_ps((__m256)mask));
#else
  unsigned result = 0;
  for (int i = 0; i < 8; ++i) result |= (mask[i] != 0 ? 1u : 0u) << i;
  return result;
#endif
}
