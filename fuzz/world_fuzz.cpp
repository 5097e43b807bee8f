// Random sequences of calls of the world's interface on both simulators: invalid ones are refused with an `Error`, and
// all published states always stay finite.
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

  // Mostly living bodies, sometimes removed ones.
  BodyId id() {
    if (ids_.empty()) return {};
    return ids_[input_.byte() % ids_.size()];
  }

  void add() {
    BodyDef def;
    const std::uint8_t bits = input_.byte();
    def.motion = bits % 8 == 0 ? MotionType::fixed : bits % 8 == 1 ? MotionType::kinematic : MotionType::dynamic;
    const bool is_surface = def.motion != MotionType::dynamic && input_.byte() % 2 == 0;
    def.shape = is_surface ? input_.surface() : (bits & 8) != 0 ? input_.compound() : input_.shape();
    def.pose.position = input_.vector();
    if (bits & 16) def.pose.rotation = input_.rotation();
    if (bits & 32) def.velocity.linear = input_.vector();
    if (bits & 64) def.velocity.angular = input_.vector();
    if (bits & 128) def.mass = input_.number();
    def.material = {input_.number(), static_cast<float>(input_.byte()) / 255.0f};
    ids_.push_back(world_.add(def));
  }

  JointId joint_id() {
    if (joints_.empty()) return {};
    return joints_[input_.byte() % joints_.size()];
  }

  void call_joint() {
    const std::uint8_t kind = input_.byte();
    if (kind % 8 < 3) {
      const BodyId a = id();
      return joints_.push_back(world_.add_joint(input_.joint(a, id())));
    }
    const JointId joint = joint_id();
    switch (kind % 8) {
      case 3:
        return world_.remove_joint(joint);
      case 4:
        return world_.set_joint_axis(joint, static_cast<JointAxisName>(input_.byte() % 7), input_.axis());
      case 5:
        if (kind & 8) return world_.set_joint_frames(joint, input_.frame(), input_.frame());
        return world_.set_joint_target(joint, input_.vector());
      case 6:
        if (kind & 8) return world_.set_joint_break(joint, input_.number(), input_.number());
        return world_.set_joint_spring(joint, input_.number(), input_.number());
      default:
        return world_.change_joint(joint, input_.joint({}, world_.joint(joint).b));
    }
  }

  void call() {
    switch (input_.byte() % 24) {
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
        const Vec3 origin = input_.vector(), translation = input_.vector();
        return check(world_.cast_ray(origin, translation), world_.cast_ray_all(origin, translation));
      }
      case 13: {
        const Shape shape = input_.shape();
        Pose pose;
        pose.position = input_.vector();
        pose.rotation = input_.rotation();
        for (const BodyId body : world_.overlap_shape(shape, pose))
          fuzz::require(world_.closest_points(shape, pose, body).distance == 0);
        const Vec3 translation = input_.vector();
        return check(world_.cast_shape(shape, pose, translation), world_.cast_shape_all(shape, pose, translation));
      }
      case 14:
        return world_.set_gravity(input_.vector());
      case 15:
        world_.for_each_contact([](const ContactInfo& c) { fuzz::require(c.point_count >= 0 && c.point_count <= 4); });
        return;
      case 16:
        return world_.wake(id());
      case 17:
      case 18:
      case 19:
      case 20:
        return call_joint();
      default:
        world_.step();
        return check();
    }
  }

  static void check(const std::optional<CastHit>& nearest, const std::vector<CastHit>& all) {
    fuzz::require(nearest.has_value() == !all.empty());
    if (nearest) fuzz::require(nearest->body == all.front().body && nearest->fraction == all.front().fraction);
    for (const CastHit& hit : all) fuzz::require(hit.fraction >= 0 && hit.fraction <= 1);
  }

  void check() const {
    for (const BodyId body : world_.bodies()) {
      const Velocity& v = world_.velocity(body);
      fuzz::require(is_finite(world_.pose(body)) && is_finite(v.linear) && is_finite(v.angular));
    }
    for (const JointId joint : world_.joints()) {
      const JointReaction reaction = world_.reaction(joint);
      fuzz::require(is_finite(reaction.force) && is_finite(reaction.torque));
      fuzz::require(world_.contains(world_.joint(joint).a) && world_.contains(world_.joint(joint).b));
    }
  }

  fuzz::Input& input_;
  World world_;
  std::vector<BodyId> ids_;
  std::vector<JointId> joints_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Session(input).run();
  return 0;
}
