// Commands, each compared with the world's own function.
#include <gmock/gmock.h>

#include <functional>
#include <utility>
#include <vector>

#include "engine/command_runner.hpp"
#include "engine_fixture.hpp"
#include "random.hpp"

namespace fathom::engine::test::engine_command_test {
namespace {

using testing::HasSubstr;

TEST(EngineCommands, DoWhatTheWorldsFunctionsDo) {
  const Vec3 a{0.3f, -0.2f, 0.5f}, b{0.1f, 0.4f, -0.3f};
  const Quat turned = fathom::test::axis_angle({1, 2, 3}, 0.4f);
  World by_command(fathom::test::quiet_world()), direct(fathom::test::quiet_world());
  const BodyId id = by_command.add(cube({0, 0, 5}));
  direct.add(cube({0, 0, 5}));
  CommandRunner runner(by_command);
  const BodyHandle handle = runner.handle(id);
  using enum CommandKind;
  const std::pair<CommandKind, std::function<void()>> pairs[] = {
      {set_pose,
       [&] {
         direct.set_pose(id, {a, 0, turned});
       }},
      {set_velocity, [&] { direct.set_velocity(id, a, b); }},
      {add_velocity, [&] { direct.add_velocity(id, a, b); }},
      {force, [&] { direct.apply_force(id, a); }},
      {force_at, [&] { direct.apply_force_at(id, a, b); }},
      {torque, [&] { direct.apply_torque(id, a); }},
      {impulse, [&] { direct.apply_impulse(id, a); }},
      {impulse_at, [&] { direct.apply_impulse_at(id, a, b); }},
      {angular_impulse, [&] { direct.apply_angular_impulse(id, a); }},
      {wake, [&] { direct.wake(id); }},
      {set_gravity, [&] { direct.set_gravity(a); }},
      {set_gravity_scale, [&] { direct.set_gravity_scale(id, a.x); }},
      {set_damping, [&] { direct.set_damping(id, a.x, 0.2f); }},
      {set_material,
       [&] {
         direct.set_material(id,
                             {.friction = a.x, .restitution = 0.2f, .rolling_resistance = 0.1f, .surface_velocity = b});
       }},
  };
  std::uint64_t before = direct.state_hash();
  for (const auto& [kind, act] : pairs) {
    const bool of_scalars = kind == set_damping || kind == set_material;
    CommandList list;
    list.push({kind, handle, of_scalars ? Vec3{a.x, 0.2f, 0.1f} : a, b, turned, 0});
    runner.run(list);
    act();
    by_command.step();
    direct.step();
    EXPECT_EQ(by_command.state_hash(), direct.state_hash()) << "command " << static_cast<int>(kind);
    EXPECT_NE(direct.state_hash(), std::exchange(before, direct.state_hash()));
  }
  // For kinematic bodies.
  BodyDef lift = cube({3, 0, 5});
  lift.motion = MotionType::kinematic;
  const BodyHandle platform{7, 1};
  const BodyId kinematic = direct.add(lift);
  CommandList moving;
  moving.add(platform, lift);
  moving.push({move_to, platform, a, {}, turned, 0});
  runner.run(moving);
  direct.move_to(kinematic, {a, 0, turned});
  by_command.step();
  direct.step();
  EXPECT_EQ(by_command.pose(runner.body(platform)).position, a);
  EXPECT_EQ(by_command.state_hash(), direct.state_hash());
  CommandList removal;
  removal.push({remove, handle, {}, {}, {}, 0});
  runner.run(removal);
  EXPECT_EQ(by_command.body_count(), 1u);  // the kinematic one
  EXPECT_THAT(refusal([&] { runner.run(removal); }), HasSubstr("body"));
}

TEST(EngineCommands, ChangesOfAJointThatIsNotThereAreNamed) {
  World world(fathom::test::quiet_world());
  CommandRunner runner(world);
  CommandList bodies, lists[2];
  bodies.add({0, 1}, cube({0, 0, 1}));
  bodies.add({1, 1}, cube({3, 0, 1}));
  bodies.joint(CommandKind::join, {0, 1}, {1, 1}, ball_joint({}, {}, {1.5f, 0, 0}, {-1.5f, 0, 0}));
  runner.run(bodies);
  JointDef named;
  named.user_data = 9;
  lists[0].joint(CommandKind::change_joint, {0, 1}, {1, 1}, named);
  lists[1].joint(CommandKind::unjoin, {0, 1}, {1, 1}, named);
  for (const CommandList& list : lists)
    EXPECT_THAT(refusal([&] { runner.run(list); }), HasSubstr("has the user data 9"));
  named.user_data = 0;
  CommandList part;
  part.joint(CommandKind::unjoin, {0, 1}, {1, 1}, named);
  runner.run(part);
  EXPECT_EQ(world.joint_count(), 0u);
}

TEST(EngineCommands, ManyBodiesHaveTheirOwnHandles) {
  fathom::test::Generator random(11);
  World world(fathom::test::quiet_world());
  CommandRunner runner(world);
  CommandList list;
  std::vector<BodyDef> defs;
  for (std::uint32_t i = 0; i < 1500; ++i) {
    defs.push_back(cube(40.0f * fathom::test::in_cube(random)));
    list.add({i, 1}, defs.back());
  }
  runner.run(list);
  for (std::uint32_t i = 0; i < defs.size(); ++i) {
    EXPECT_EQ(world.pose(runner.body({i, 1})).position, defs[i].pose.position);
    EXPECT_EQ(runner.handle(runner.body({i, 1})).index, i);
  }
}

TEST(EngineCommands, ARefusedBodyAmongManyIsNamed) {
  World world(fathom::test::quiet_world());
  CommandRunner runner(world);
  CommandList list;
  for (std::uint32_t i = 0; i < 4; ++i) {
    BodyDef def = cube({2.0f * static_cast<float>(i), 0, 1});
    if (i == 2) def.mass = -1;
    list.add({i, 1}, def);
  }
  EXPECT_THAT(refusal([&] { runner.run(list); }), HasSubstr("body {index 2, generation 1}: "));
}

}  // namespace
}  // namespace fathom::engine::test::engine_command_test
