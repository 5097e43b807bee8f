// Random sequences of calls of the world's interface on both simulators: wrong ones are refused with an `Error`, and
// whatever happens all published states stay finite.
#include <fathom/world.hpp>

#include "input.hpp"

namespace {

using namespace fathom;

class Session {
 public:
  explicit Session(fuzz::Input& input) : input_(input), world_(definition(input)) {}

  void run() {
    for (int calls = 0; calls < 200 && !input_.empty(); ++calls) {
      try {
        call();
      } catch (const Error&) {
      }
    }
    world_.step();
    check();
  }

 private:
  static WorldDef definition(fuzz::Input& input) {
    const std::uint8_t bits = input.byte();
    WorldDef def;
    def.threads = 1;
    if (bits & 1) {
      def.simulator = SimulatorKind::device;
      def.device = "host";
    }
    if (bits & 2) def.broad_phase = BroadPhase::sweep;
    if (bits & 4) def.solver.method = Solver::impulse;
    def.solver.substeps = 1 + (bits >> 3 & 3);
    def.solver.iterations = 2;
    def.sleep.enabled = (bits & 32) != 0;
    def.max_bodies = 64;
    return def;
  }

  // Mostly bodies that live, sometimes ones that died.
  BodyId id() {
    if (ids_.empty()) return {};
    return ids_[input_.byte() % ids_.size()];
  }

  void add() {
    BodyDef def;
    const std::uint8_t bits = input_.byte();
    def.motion = bits % 8 == 0 ? MotionType::fixed : bits % 8 == 1 ? MotionType::kinematic : MotionType::dynamic;
    def.shape = input_.shape();
    def.pose.position = input_.vector();
    if (bits & 16) def.pose.rotation = input_.rotation();
    if (bits & 32) def.velocity.linear = input_.vector();
    if (bits & 64) def.velocity.angular = input_.vector();
    if (bits & 128) def.mass = input_.number();
    def.material = {input_.number(), static_cast<float>(input_.byte()) / 255.0f};
    ids_.push_back(world_.add(def));
  }

  void call() {
    switch (input_.byte() % 20) {
      case 0:
      case 1:
      case 2:
        return add();
      case 3:
        return world_.remove(id());
      case 4: {
        Pose pose;
        const BodyId body = id();
        pose.position = input_.vector();
        pose.rotation = input_.rotation();
        return world_.set_pose(body, pose);
      }
      case 5: {
        const BodyId body = id();
        const Vec3 linear = input_.vector();
        return world_.set_velocity(body, linear, input_.vector());
      }
      case 6: {
        const BodyId body = id();
        const Vec3 force = input_.vector();
        return world_.apply_force_at(body, force, input_.vector());
      }
      case 7: {
        const BodyId body = id();
        return world_.apply_impulse(body, input_.vector());
      }
      case 8: {
        const BodyId body = id();
        return world_.apply_torque(body, input_.vector());
      }
      case 9: {
        const BodyId body = id();
        return world_.set_material(body, {input_.number(), input_.number()});
      }
      case 10: {
        const BodyId body = id();
        return world_.set_filter(body, {input_.byte(), input_.byte()});
      }
      case 11: {
        const BodyId body = id();
        return world_.set_damping(body, input_.number(), input_.number());
      }
      case 12: {
        const Vec3 origin = input_.vector();
        world_.ray_cast(origin, input_.vector());
        return;
      }
      case 13: {
        const Shape shape = input_.shape();
        Pose pose;
        pose.position = input_.vector();
        pose.rotation = input_.rotation();
        world_.overlap_shape(shape, pose);
        return;
      }
      case 14:
        return world_.set_gravity(input_.vector());
      case 15:
        world_.for_each_contact([](const ContactInfo& c) { fuzz::require(c.point_count >= 0 && c.point_count <= 4); });
        return;
      case 16:
        return world_.wake(id());
      default:
        world_.step();
        return check();
    }
  }

  void check() const {
    for (const BodyId body : world_.bodies()) {
      const Velocity& v = world_.velocity(body);
      fuzz::require(is_finite(world_.pose(body)) && is_finite(v.linear) && is_finite(v.angular));
    }
  }

  fuzz::Input& input_;
  World world_;
  std::vector<BodyId> ids_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Session(input).run();
  return 0;
}
