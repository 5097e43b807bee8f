// Reads values from a fuzzer's bytes; beyond their end everything is zero.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fathom/error.hpp>
#include <fathom/shape.hpp>
#include <vector>

namespace fathom::fuzz {

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), left_(size) {}

  bool empty() const { return left_ == 0; }
  std::uint8_t byte() {
    if (left_ == 0) return 0;
    --left_;
    return *data_++;
  }
  /// Any bits: NaN, infinities and denormals too.
  float any_float() {
    std::uint32_t bits = 0;
    for (int i = 0; i < 4; ++i) bits = bits << 8 | byte();
    float value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }
  /// Mostly numbers of everyday size on a coarse grid, so that things touch and coincide; sometimes any bits.
  float number() {
    const std::uint8_t kind = byte();
    if (kind == 255) return any_float();
    const float grid = static_cast<float>(static_cast<std::int8_t>(byte())) / 16.0f;
    if (kind < 224) return grid;
    return grid * std::ldexp(1.0f, static_cast<int>(byte()) - 128);  // 1e-38 … 1e39
  }
  Vec3 vector() {
    const float x = number(), y = number(), z = number();
    return {x, y, z};
  }
  Quat rotation() {
    const float w = number();
    const Vec3 v = vector();
    return {w, v.x, v.y, v.z};
  }
  /// Throws `Error` where the bytes make no shape.
  Shape shape() {
    switch (byte() % 4) {
      case 0:
        return sphere(std::abs(number()));
      case 1: {
        const float radius = std::abs(number());
        return capsule(radius, std::abs(number()));
      }
      case 2:
        return box(abs(vector()));
      default:
        return hull(points(4 + byte() % 16));
    }
  }
  std::vector<Vec3> points(int count) {
    std::vector<Vec3> list;
    for (int i = 0; i < count; ++i) list.push_back(vector());
    return list;
  }

 private:
  const std::uint8_t* data_;
  std::size_t left_;
};

/// Ends the program where a promise is broken, which is what a fuzzer looks for.
inline void require(bool promise) {
  if (!promise) std::abort();
}

}  // namespace fathom::fuzz
