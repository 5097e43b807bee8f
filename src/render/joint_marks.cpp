#include "render/joint_marks.hpp"

namespace fathom::render {
namespace {

constexpr Colour arm_colour{120, 200, 255, 200}, gap_colour{255, 60, 220, 255};
constexpr Colour anchor_a_colour{60, 140, 255, 255}, anchor_b_colour{255, 170, 40, 255};
constexpr Colour reaction_colour{110, 230, 90, 255};
constexpr float weight_length = 0.5f;  // m

struct Anchors {
  Vec3 a, b;
};

Anchors anchors_of(const World& world, const JointDef& joint) {
  const auto at = [&](BodyId body, const Pose& frame) { return transform(world.poses()[body.index], frame.position); };
  return {at(joint.a, joint.frame_a), at(joint.b, joint.frame_b)};
}

}  // namespace

void add_joint_marks(const World& world, std::vector<Mark>& marks) {
  for (const JointId id : world.joints()) {
    const JointDef& joint = world.joint(id);
    const Anchors anchors = anchors_of(world, joint);
    const auto add_arm = [&](BodyId body, Vec3 anchor) {
      if (world.motion(body) == MotionType::dynamic)
        marks.push_back({world.poses()[body.index].position, 1.5f, anchor, arm_colour});
    };
    add_arm(joint.a, anchors.a);
    add_arm(joint.b, anchors.b);
    marks.push_back({anchors.a, 3, anchors.b, gap_colour});
    // The larger one first, so that both are seen where they meet.
    marks.push_back({anchors.a, 8, anchors.a, anchor_a_colour});
    marks.push_back({anchors.b, 4, anchors.b, anchor_b_colour});
  }
}

void add_reaction_marks(const World& world, std::vector<Mark>& marks) {
  // One scale for all, so that they can be compared: under a heavy load a light link carries many times its own weight.
  float heaviest = 1e-6f;
  for (const JointId id : world.joints())
    heaviest = max(heaviest, max(world.mass(world.joint(id).a), world.mass(world.joint(id).b)));
  const float scale = weight_length / (max(length(world.gravity()), 1.0f) * heaviest);
  for (const JointId id : world.joints()) {
    const Vec3 anchor = anchors_of(world, world.joint(id)).b;
    marks.push_back({anchor, 3, anchor + scale * world.reaction(id).force, reaction_colour});
  }
}

}  // namespace fathom::render
