#include "scene/made_ground.hpp"

#include <cmath>

#include "scene/scene_parts.hpp"

namespace fathom {
namespace {

/// Uniform in [−1, 1], by grid point.
double noise(std::uint64_t seed, std::int64_t i, std::int64_t j) {
  Random mixed(seed ^ static_cast<std::uint64_t>(i) * 0x9E3779B97F4A7C15u);
  Random twice(mixed.bits() ^ static_cast<std::uint64_t>(j) * 0xC2B2AE3D27D4EB4Fu);
  return twice.symmetric(1);
}

/// Interpolates smoothly between the points of a grid of width 1.
double smooth_noise(std::uint64_t seed, double x, double y) {
  const double i = std::floor(x), j = std::floor(y);
  const auto eased = [](double t) { return t * t * t * (t * (6 * t - 15) + 10); };
  const double u = eased(x - i), v = eased(y - j);
  const auto a = static_cast<std::int64_t>(i), b = static_cast<std::int64_t>(j);
  const double near = noise(seed, a, b) + u * (noise(seed, a + 1, b) - noise(seed, a, b));
  const double far = noise(seed, a, b + 1) + u * (noise(seed, a + 1, b + 1) - noise(seed, a, b + 1));
  return near + v * (far - near);
}

}  // namespace

double Waves::at(double x, double y) const {
  Random random(seed);
  random.bits();  // neighbouring seeds begin alike
  constexpr double shares[] = {0.5, 0.3, 0.2}, shorter[] = {1, 0.7, 0.45};
  double sum = 0;
  for (int train = 0; train < 3; ++train) {
    const Direction along(random.unit());
    const double turns = (along.x * x + along.y * y) / (shorter[train] * length) + random.unit();
    sum += shares[train] * Direction(turns).x;
  }
  return 0.5 * height * sum;
}

double Hills::at(double x, double y) const {
  double sum = 0, share = 1, total = 0, width = length;
  for (int layer = 0; layer < layers; ++layer) {
    sum += share * smooth_noise(seed + static_cast<std::uint64_t>(layer), x / width, y / width);
    total += share;
    share *= roughness;
    width *= 0.5;
  }
  return 0.5 * height * sum / total;
}

}  // namespace fathom
