#include <cstdio>
#include <fathom/world.hpp>

using namespace fathom;

int main() {
  World world;

  // A crane's hook on a rope of three links, and a crate of 50 kg on the hook.
  BodyId above = world.add({.motion = MotionType::fixed, .pose = {.position = {0, 0, 10}}, .shape = sphere(0.2f)});
  JointId top{};
  for (int i = 0; i < 3; ++i) {
    const BodyId link = world.add(
        {.pose = {.position = {0, 0, 9.5f - static_cast<float>(i)}}, .shape = capsule(0.1f, 0.4f), .mass = 1.0f});
    const Vec3 anchor_above = i == 0 ? Vec3{0, 0, 0} : Vec3{0, 0, -0.5f};
    const JointId joint = world.add_joint(ball_joint(above, link, anchor_above, {0, 0, 0.5f}));
    if (i == 0) top = joint;
    above = link;
  }
  const BodyId crate = world.add({.pose = {.position = {0, 0, 6.5f}}, .shape = box({0.5f, 0.5f, 0.5f}), .mass = 50.0f});
  world.add_joint(ball_joint(above, crate, {0, 0, -0.5f}, {0, 0, 0.5f}));

  // A door on a hinge along z, with limits and a motor of 0.5 rad/s and at most 40 N·m.
  const Vec3 up{0, 0, 1};
  const BodyId post = world.add({.motion = MotionType::fixed, .pose = {.position = {5, 0, 1}}, .shape = sphere(0.1f)});
  const BodyId door = world.add({.pose = {.position = {5.5f, 0, 1}}, .shape = box({0.5f, 0.05f, 1}), .mass = 20.0f});
  JointDef hinge = revolute_joint(post, door, joint_frame({0, 0, 0}, up), joint_frame({-0.5f, 0, 0}, up));
  hinge.axis(JointAxisName::twist).limit(0, 1.5f).drive_velocity(0.5f, 40);
  const JointId door_hinge = world.add_joint(hinge);

  for (int i = 0; i < 120; ++i) world.step();
  std::printf("the top joint carries %.0f N\n", world.reaction(top).force.z);
  std::printf("the door is open by %.2f rad\n",
              world.joint_positions(door_hinge)[static_cast<std::size_t>(JointAxisName::twist)]);
}
