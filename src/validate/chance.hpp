// Random draws of the suite's random scenes.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "scene/random.hpp"
#include "validate/bodies.hpp"

namespace fathom::validate {

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}

  bool coin() { return below(2) != 0; }
  double between(double a, double b) { return a + (b - a) * 0.5 * (1 + random_.symmetric(1)); }
  double log_between(double a, double b) { return std::exp(between(std::log(a), std::log(b))); }
  int below(int n) { return std::min(static_cast<int>(between(0, n)), n - 1); }
  float log_float(double a, double b) { return narrow(log_between(a, b)); }
  Vec3 vector(double size) { return {symmetric(size), symmetric(size), symmetric(size)}; }
  Vec3 direction() {
    for (;;) {
      const Vec3 v = vector(1);
      if (const float square = length_squared(v); square > 0.01f && square < 1) return normalize(v);
    }
  }
  Quat rotation() { return normalize(Quat{symmetric(1), symmetric(1), symmetric(1), symmetric(1)}); }

  /// The longest half side is `size` (m), the others are down to `thinnest` of it.
  Shape shape(double size, double thinnest) {
    const auto side = [&] { return narrow(size * log_between(thinnest, 1)); };
    const float longest = narrow(size), x = side(), y = side();
    switch (below(4)) {
      case 0:
        return sphere(longest);
      case 1:
        return capsule(x, longest);
      case 2:
        return box({x, y, longest});
      default:
        break;
    }
    std::vector<Vec3> corners;
    for (int i = 8 + below(16); i > 0; --i) {
      const Vec3 d = direction();
      corners.push_back({x * d.x, y * d.y, longest * d.z});
    }
    return hull(corners);
  }

 private:
  float symmetric(double size) { return narrow(random_.symmetric(size)); }
  Random random_;
};

}  // namespace fathom::validate
