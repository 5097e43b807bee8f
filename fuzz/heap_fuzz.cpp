// Random heaps: bodies of everyday sizes, thrown into a closed bin at any speed and spin. All stay finite, and none is
// quarantined.
#include <algorithm>
#include <fathom/world.hpp>

#include "input.hpp"
#include "scene/heap_bodies.hpp"
#include "worlds.hpp"

namespace {

using namespace fathom;

constexpr float half_width = 3, half_height = 6, half_wall = 0.5f;  // of the bin and its walls (m)

class Bin {
 public:
  explicit Bin(fuzz::Input& input) : input_(input), world_(definition(input)) {
    const Material material{part(), 0};
    const float x = half_width + half_wall, z = half_height + half_wall;
    for (const float side : {-1.0f, 1.0f}) {
      add_wall({x + half_wall, x + half_wall, half_wall}, {0, 0, side * z}, material);
      add_wall({half_wall, x, half_height}, {side * x, 0, 0}, material);
      add_wall({half_width, half_wall, half_height}, {0, side * x, 0}, material);
    }
  }

  void run() {
    for (int slot = 0; slot < 40 && !input_.empty(); ++slot) add_body(slot);
    for (int step = 0; step < 60; ++step) {
      world_.step();
      fuzz::require(world_.quarantined().empty());
    }
    for (const BodyId body : world_.bodies()) {
      const Pose& pose = world_.pose(body);
      const Velocity& velocity = world_.velocity(body);
      fuzz::require(is_finite(pose) && is_finite(velocity.linear) && is_finite(velocity.angular));
    }
  }

 private:
  static WorldDef definition(fuzz::Input& input) {
    const std::uint8_t bits = input.byte();
    WorldDef def = fuzz::definition(bits % 4 == 0 ? SimulatorKind::device : SimulatorKind::native);
    def.solver.substeps = 2 + (bits >> 2 & 7) % 7;
    constexpr float rates[] = {30, 60, 120, 240};
    def.dt = 1 / rates[bits >> 5 & 3];
    def.sleep.enabled = bits >= 128;
    return def;
  }

  /// 0 to 1.
  float part() { return static_cast<float>(input_.byte()) / 255; }
  /// 1 to 2^powers.
  float factor(int powers) { return std::ldexp(1 + part(), input_.byte() % powers); }
  Vec3 direction() {
    const float x = 2 * part() - 1, y = 2 * part() - 1, z = 2 * part() - 1;
    return {x, y, z};
  }

  void add_wall(Vec3 half_extents, Vec3 position, const Material& material) {
    BodyDef def = fuzz::body(box(half_extents), position, MotionType::fixed);
    def.material = material;
    world_.add(def);
  }

  /// 1.2 m to 4 cm long and at most a hundred times as thin.
  Shape shape() {
    const float half = 0.6f / factor(5);
    const float thin = std::max(half / factor(6), 5e-4f);
    const float middle = half + (thin - half) * part();
    switch (input_.byte() % 4) {
      case 0:
        return sphere(half);
      case 1:
        return capsule(thin, half - thin);
      case 2:
        return box({half, middle, thin});
      default:
        break;
    }
    std::vector<Vec3> points{{half, 0, 0}, {-half, 0, 0}, {0, middle, 0}, {0, -middle, 0}, {0, 0, thin}, {0, 0, -thin}};
    for (int more = input_.byte() % 8; more > 0; --more) {
      const Vec3 d = direction();
      points.push_back({half * d.x, middle * d.y, thin * d.z});
    }
    return hull(points);
  }

  void add_body(int slot) {
    BodyDef def;
    try {
      def.shape = shape();
    } catch (const Error&) {
      return;
    }
    // Each in a cell of its own, 1.5 m wide.
    def.pose.position = {1.5f * static_cast<float>(slot % 3 - 1), 1.5f * static_cast<float>(slot / 3 % 3 - 1),
                         1.5f * static_cast<float>(slot / 9) - 4};
    const Vec3 axis = direction();
    def.pose.rotation = {1, axis.x, axis.y, axis.z};
    def.density = 100 * factor(7);
    def.material = {part(), 0.9f * part()};
    def.velocity.linear = 20 * direction();
    def.velocity.angular = factor(7) * direction();
    world_.add(def);
  }

  fuzz::Input& input_;
  World world_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Bin(input).run();
  return 0;
}
