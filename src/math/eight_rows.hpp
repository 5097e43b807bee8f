// Rows of eight numbers in memory, transposed to columns in registers. For the host only.
#pragma once

#include <cstring>

#include "math/eight.hpp"

namespace fathom {

inline Eight load_row(const float* from) {
  Eight row;
  std::memcpy(&row, from, sizeof(row));
  return row;
}
inline void store_row(const Eight& row, float* to) { std::memcpy(to, &row, sizeof(row)); }

/// Rows become columns.
inline void transpose(Eight (&m)[8]) {
  Eight t[8], u[8];
  for (int i = 0; i < 8; i += 2) {
    t[i] = __builtin_shufflevector(m[i], m[i + 1], 0, 8, 2, 10, 4, 12, 6, 14);
    t[i + 1] = __builtin_shufflevector(m[i], m[i + 1], 1, 9, 3, 11, 5, 13, 7, 15);
  }
  for (int i = 0; i < 8; i += 4)
    for (int j = i; j < i + 2; ++j) {
      u[j] = __builtin_shufflevector(t[j], t[j + 2], 0, 1, 8, 9, 4, 5, 12, 13);
      u[j + 2] = __builtin_shufflevector(t[j], t[j + 2], 2, 3, 10, 11, 6, 7, 14, 15);
    }
  for (int i = 0; i < 4; ++i) {
    m[i] = __builtin_shufflevector(u[i], u[i + 4], 0, 1, 2, 3, 8, 9, 10, 11);
    m[i + 4] = __builtin_shufflevector(u[i], u[i + 4], 4, 5, 6, 7, 12, 13, 14, 15);
  }
}

}  // namespace fathom
