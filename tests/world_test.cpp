// The interface of the world: ids, changes between steps, events, queries, errors.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <vector>

#include "random.hpp"
#include "world_fixture.hpp"

namespace fathom::test::world_test {
namespace {

using testing::HasSubstr;

constexpr float nan = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

template <class Call>
void expect_error(ErrorCode code, const std::string& part, const Call& call) {
  try {
    call();
    ADD_FAILURE() << "no error; expected one with '" << part << "'";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    EXPECT_THAT(error.what(), HasSubstr(part));
  }
}

TEST(World, IdsOfRemovedBodiesAreErrors) {
  World world(quiet_world());
  const BodyId a = world.add(cube({0, 0, 1}));
  const BodyId b = world.add(cube({3, 0, 1}));
  world.remove(a);
  EXPECT_FALSE(world.contains(a));
  EXPECT_TRUE(world.contains(b));
  EXPECT_EQ(world.body_count(), 1u);
  expect_error(ErrorCode::stale_id, "was removed", [&] { world.remove(a); });
  expect_error(ErrorCode::stale_id, "was removed", [&] { (void)world.pose(a); });
  expect_error(ErrorCode::stale_id, "was removed", [&] { world.apply_force(a, {1, 0, 0}); });
  expect_error(ErrorCode::stale_id, "never existed", [&] { (void)world.velocity({77, 1}); });
  const BodyId c = world.add(cube({0, 0, 1}));
  EXPECT_EQ(c.index, a.index);
  EXPECT_NE(c.generation, a.generation);
  expect_error(ErrorCode::stale_id, "was removed", [&] { world.set_velocity(a, {}, {}); });
  EXPECT_THAT(std::vector<BodyId>(world.bodies().begin(), world.bodies().end()), testing::ElementsAre(c, b));
}

TEST(World, RefusesBadBodiesAndStaysAsItWas) {
  World world(quiet_world());
  world.add(ground());
  const std::uint64_t hash = world.state_hash();
  const auto refuse = [&](const std::string& part, auto&& change) {
    BodyDef def = cube({0, 0, 1});
    change(def);
    expect_error(ErrorCode::invalid_argument, part, [&] { world.add(def); });
    EXPECT_EQ(world.body_count(), 1u);
    EXPECT_EQ(world.state_hash(), hash);
  };
  refuse("position", [](BodyDef& d) { d.pose.position.x = nan; });
  refuse("position", [](BodyDef& d) { d.pose.position.z = infinity; });
  refuse("rotation", [](BodyDef& d) { d.pose.rotation = {0, 0, 0, 0}; });
  refuse("velocity", [](BodyDef& d) { d.velocity.linear.y = nan; });
  refuse("mass is -1", [](BodyDef& d) { d.mass = -1.0f; });
  refuse("mass is 0", [](BodyDef& d) { d.mass = 0.0f; });
  refuse("density", [](BodyDef& d) { d.mass.reset(), d.density = -3; });
  refuse("half extent", [](BodyDef& d) { d.shape.half_extents.y = 0; });
  refuse("radius", [](BodyDef& d) { d.shape.type = ShapeType::sphere, d.shape.radius = -2; });
  refuse("hull", [](BodyDef& d) { d.shape.type = ShapeType::hull; });
  refuse("friction", [](BodyDef& d) { d.material.friction = -0.1f; });
  refuse("restitution", [](BodyDef& d) { d.material.restitution = 1.5f; });
  refuse("rolling resistance is -0.1", [](BodyDef& d) { d.material.rolling_resistance = -0.1f; });
  refuse("damping", [](BodyDef& d) { d.linear_damping = nan; });
  refuse("inertia", [](BodyDef& d) { d.inertia = SymMat3{1, 1, -1, 0, 0, 0}; });
  refuse("principal moments", [](BodyDef& d) { d.inertia = SymMat3{1, 1, 2.1f, 0, 0, 0}; });
  refuse("principal moments", [](BodyDef& d) { d.inertia = SymMat3{2, 2, 1, 1.5f, 0, 0}; });
  refuse("gravity scale", [](BodyDef& d) { d.gravity_scale = nan; });
  refuse("friction rule is 77", [](BodyDef& d) { d.material.friction_rule = static_cast<CombineRule>(77); });
  refuse("restitution rule is 5", [](BodyDef& d) { d.material.restitution_rule = static_cast<CombineRule>(5); });
  refuse("motion is 9", [](BodyDef& d) { d.motion = static_cast<MotionType>(9); });
}

TEST(World, TakesTheInertiaOfAFlatBody) {
  World world(quiet_world());
  BodyDef def = cube({0, 0, 1});
  def.inertia = SymMat3{1, 1, 2, 0, 0, 0};
  def.pose.rotation = axis_angle({1, 2, 3}, 0.7f);
  const BodyId id = world.add(def);
  EXPECT_EQ(world.mass_properties(id).inertia.zz, 2);
}

TEST(World, RefusesBadDefinitions) {
  const auto refuse = [](const std::string& part, auto&& change) {
    WorldDef def = sleepy_world();
    change(def);
    expect_error(ErrorCode::invalid_argument, part, [&] { World world(def); });
  };
  refuse("dt is 0", [](WorldDef& d) { d.dt = 0; });
  refuse("dt is -1", [](WorldDef& d) { d.dt = -1; });
  refuse("dt", [](WorldDef& d) { d.dt = nan; });
  refuse("between 1e-6 and 1 s", [](WorldDef& d) { d.dt = 1e-30f; });
  refuse("gravity", [](WorldDef& d) { d.gravity.z = infinity; });
  refuse("threads is -2", [](WorldDef& d) { d.threads = -2; });
  refuse("simulator is 3", [](WorldDef& d) { d.simulator = static_cast<SimulatorKind>(3); });
  refuse("broad_phase is 77", [](WorldDef& d) { d.broad_phase = static_cast<BroadPhase>(77); });
  refuse("partition is 2", [](WorldDef& d) { d.partition = static_cast<Partition>(2); });
  refuse("solver.method is 9", [](WorldDef& d) { d.solver.method = static_cast<Solver>(9); });
  refuse("substeps is 0", [](WorldDef& d) { d.solver.substeps = 0; });
  refuse("sweep_axis", [](WorldDef& d) { d.sweep_axis = {0, 0, 0}; });
  refuse("sweep_axis", [](WorldDef& d) { d.sweep_axis = {1, -1, 0}; });
}

TEST(World, RefusesMoreBodiesThanItsLimit) {
  WorldDef def = quiet_world();
  def.max_bodies = 2;
  World world(def);
  world.add(ground());
  world.add(cube({0, 0, 1}));
  expect_error(ErrorCode::capacity, "limit of 2", [&] { world.add(cube({0, 0, 3})); });
  expect_error(ErrorCode::capacity, "limit of 2", [&] { world.reserve(1'000'000'000); });
  EXPECT_EQ(world.body_count(), 2u);
}

TEST(World, AddsSeveralBodiesAtOnce) {
  World world(quiet_world());
  const std::vector<BodyDef> defs{ground(), cube({0, 0, 1}), cube({4, 0, 2})};
  const std::vector<BodyId> ids = world.add_bodies(defs);
  ASSERT_EQ(ids.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(world.pose(ids[i]).position, defs[i].pose.position);
  EXPECT_EQ(world.body_count(), 3u);
  EXPECT_TRUE(world.add_bodies({}).empty());
}

TEST(World, AddsNoneOfSeveralBodiesWhereOneIsRefused) {
  WorldDef def = quiet_world();
  def.max_bodies = 3;
  World world(def);
  const BodyId gone = world.add(cube({9, 0, 1}));
  world.remove(gone);
  const std::uint64_t hash = world.state_hash();
  std::vector<BodyDef> defs{cube({0, 0, 1}), cube({3, 0, 1}), cube({6, 0, 1})};
  defs[1].pose.position.x = nan;
  expect_error(ErrorCode::invalid_argument, "body 1: ", [&] { world.add_bodies(defs); });
  EXPECT_EQ(world.body_count(), 0u);
  defs[1].pose.position.x = 3;
  defs.push_back(cube({9, 0, 1}));
  expect_error(ErrorCode::capacity, "body 3: add body: the world already holds its limit of 3",
               [&] { world.add_bodies(defs); });
  EXPECT_EQ(world.body_count(), 0u);
  EXPECT_EQ(world.state_hash(), hash);
  world.step();
  defs.pop_back();
  EXPECT_EQ(world.add_bodies(defs)[0].index, gone.index);
}

double way_from_index_to_index(const World& world) {
  double sum = 0;
  for (std::size_t i = 1; i < world.poses().size(); ++i)
    sum += static_cast<double>(length(world.poses()[i].position - world.poses()[i - 1].position));
  return sum;
}

TEST(World, NeighboursAddedTogetherGetNeighbouringIndices) {
  Generator random(7);
  std::vector<BodyDef> defs;
  for (int i = 0; i < 2000; ++i) defs.push_back(cube(50.0f * in_cube(random)));
  World one_by_one(quiet_world()), together(quiet_world());
  for (const BodyDef& def : defs) one_by_one.add(def);
  const std::vector<BodyId> ids = together.add_bodies(defs);
  for (std::size_t i = 0; i < defs.size(); ++i)
    ASSERT_EQ(together.pose(ids[i]).position, defs[i].pose.position) << "body " << i;
  EXPECT_LT(4 * way_from_index_to_index(together), way_from_index_to_index(one_by_one));
}

TEST(World, RowsOfBodiesKeepTheirOrder) {
  std::vector<BodyDef> defs;
  for (int i = 0; i < 2000; ++i)
    defs.push_back(cube({1.1f * static_cast<float>(i % 40), 1.1f * static_cast<float>(i / 40), 1}));
  World world(quiet_world());
  const std::vector<BodyId> ids = world.add_bodies(defs);
  for (std::uint32_t i = 0; i < ids.size(); ++i) ASSERT_EQ(ids[i].index, i);
}

TEST(World, ContactsOfALargeBodyComeInTheOrderOfTheOthers) {
  if (quiet_world().simulator != SimulatorKind::native)
    GTEST_SKIP() << "others list contacts as their devices find them";
  Generator random(3);
  World world(quiet_world());
  world.add(ground());
  std::vector<std::uint32_t> places(200);
  std::iota(places.begin(), places.end(), 0u);
  std::shuffle(places.begin(), places.end(), random);
  for (const std::uint32_t place : places)
    world.add(cube({2.0f * static_cast<float>(place % 20) - 19, 2.0f * static_cast<float>(place / 20) - 9, 0.5f}));
  world.step();
  ASSERT_EQ(world.contacts_begun().size(), places.size());
  EXPECT_TRUE(
      std::ranges::is_sorted(world.contacts_begun(), {}, [](const ContactEvent& event) { return event.b.index; }));
}

TEST(World, RefusesBadForces) {
  World world(quiet_world());
  const BodyId id = world.add(cube({0, 0, 1}));
  const BodyId fixed = world.add(ground());
  expect_error(ErrorCode::invalid_argument, "force", [&] { world.apply_force(id, {nan, 0, 0}); });
  expect_error(ErrorCode::invalid_argument, "torque", [&] { world.apply_torque(id, {0, infinity, 0}); });
  expect_error(ErrorCode::invalid_argument, "impulse", [&] { world.apply_impulse(id, {0, 0, nan}); });
  BodyDef moving = cube({0, 0, 9});
  moving.motion = MotionType::kinematic;
  const BodyId kinematic = world.add(moving);
  for (const BodyId body : {fixed, kinematic}) {
    const char* const motion = body == fixed ? "the body is fixed" : "the body is kinematic";
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_force(body, {1, 0, 0}); });
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_force_at(body, {1, 0, 0}, {}); });
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_torque(body, {1, 0, 0}); });
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_impulse(body, {1, 0, 0}); });
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_impulse_at(body, {1, 0, 0}, {}); });
    expect_error(ErrorCode::invalid_argument, motion, [&] { world.apply_angular_impulse(body, {1, 0, 0}); });
  }
  expect_error(ErrorCode::invalid_argument, "fixed", [&] { world.set_velocity(fixed, {1, 0, 0}, {}); });
  world.step();
  EXPECT_TRUE(is_finite(world.pose(id)));
}

TEST(World, RefusesBadQueries) {
  World world(quiet_world());
  const BodyId id = world.add(cube({0, 0, 1})), gone = world.add(cube({0, 0, 5}));
  world.remove(gone);
  const auto refused = [](const char* text, const auto& ask) { expect_error(ErrorCode::invalid_argument, text, ask); };
  const auto stale = [](const char* text, const auto& ask) { expect_error(ErrorCode::stale_id, text, ask); };
  const Vec3 bad{0, nan, 0}, down{0, 0, -1};
  refused("cast ray: the translation is zero", [&] { (void)world.cast_ray({0, 0, 0}, {0, 0, 0}); });
  refused("cast ray: the translation is (0, nan, 0)", [&] { (void)world.cast_ray({0, 0, 0}, bad); });
  refused("cast ray: the origin", [&] { (void)world.cast_ray_all(bad, down); });
  std::optional<CastHit> hits[2];
  const Ray rays[] = {{{}, down}, {{}, {}}};
  refused("ray 1: cast rays: the translation is zero", [&] { world.cast_rays(rays, hits); });
  refused("2 rays and room for 1 hits", [&] { world.cast_rays(rays, std::span(hits).first(1)); });
  const Shape ball = sphere(1);
  std::vector<ShapeCast> casts{{&ball, {}, {1, 0, 0}}, {&ball, {}, {}}};
  refused("shape 1: cast shapes: the translation is zero", [&] { world.cast_shapes(casts, hits); });
  refused("2 shapes and room for 1 hits", [&] { world.cast_shapes(casts, std::span(hits).first(1)); });
  std::vector<std::vector<BodyId>> found(2);
  world.overlap_shapes(casts, found);
  refused("2 shapes and room for 1 lists", [&] { world.overlap_shapes(casts, std::span(found).first(1)); });
  casts[0].shape = nullptr;
  refused("shape 0: overlap shapes: there is no shape", [&] { world.overlap_shapes(casts, found); });
  refused("cast shape: the position", [&] { (void)world.cast_shape(sphere(1), {bad, 0, {}}, down); });
  refused("cast shape: the translation is zero", [&] { (void)world.cast_shape_all(sphere(1), {}, {}); });
  refused("cast shape: the box's smallest half extent", [&] { (void)world.cast_shape(Shape{}, {}, down); });
  refused("overlap: the rotation", [&] { (void)world.overlap_shape(sphere(1), {{}, 0, {0, 0, 0, 0}}); });
  Shape empty = sphere(1);
  empty.radius = 0;
  refused("overlap: the sphere's radius is 0", [&] { (void)world.overlap_shape(empty, {}); });
  refused("upper corner", [&] { (void)world.overlap_aabb({{1, 1, 1}, {0, 0, 0}}); });
  refused("closest points: the sphere's radius", [&] { (void)world.closest_points(empty, {}, id); });
  stale("closest points", [&] { (void)world.closest_points(id, gone); });
  stale("closest points", [&] { (void)world.closest_points(sphere(1), {}, gone); });
  stale("cast ray", [&] { (void)world.cast_ray({}, down, {.ignored = {gone}}); });
  stale("overlap", [&] { (void)world.overlap_shape(sphere(1), {}, {.ignored = {BodyId{}}}); });
}

TEST(World, SpansHoldBodiesByIndex) {
  World world(quiet_world());
  const BodyId a = world.add(cube({1, 2, 3}));
  const BodyId b = world.add(cube({4, 5, 6}));
  EXPECT_EQ(world.poses()[a.index].position, (Vec3{1, 2, 3}));
  EXPECT_EQ(world.poses()[b.index].position, (Vec3{4, 5, 6}));
  EXPECT_EQ(&world.poses()[b.index], &world.pose(b));
  static_assert(sizeof(Pose) == 32 && sizeof(Velocity) == 32);
}

TEST(World, ContactEventsBeginAndEnd) {
  World world(quiet_world());
  const BodyId floor = world.add(ground());
  const BodyId id = world.add(cube({0, 0, 2}));
  int begun = 0, ended = 0, hits = 0;
  for (int i = 0; i < 120; ++i) {
    world.step();
    for (const ContactEvent& e : world.contacts_begun()) {
      ++begun;
      EXPECT_EQ(e.a, floor);
      EXPECT_EQ(e.b, id);
    }
    for (const HitEvent& h : world.hits()) {
      ++hits;
      EXPECT_NEAR(h.normal.z, 1, 1e-3f);
      EXPECT_NEAR(h.approach_speed, std::sqrt(2 * 9.81f * 1.0f), 0.3f);
    }
    ended += static_cast<int>(world.contacts_ended().size());
  }
  EXPECT_EQ(begun, 1);
  EXPECT_EQ(hits, 1);
  EXPECT_EQ(ended, 0);
  world.set_velocity(id, {0, 0, 5}, {});
  for (int i = 0; i < 20; ++i) {
    world.step();
    ended += static_cast<int>(world.contacts_ended().size());
  }
  EXPECT_EQ(ended, 1);
}

TEST(World, RemovingASupportEndsItsContactsAndLetsBodiesFall) {
  World world(sleepy_world());
  world.add(ground());
  const BodyId lower = world.add(cube({0, 0, 1}));
  const BodyId upper = world.add(cube({0, 0, 2}));
  run(world, 240);
  EXPECT_FALSE(world.is_awake(upper));
  world.remove(lower);
  world.step();
  EXPECT_TRUE(world.is_awake(upper));
  EXPECT_EQ(world.contacts_ended().size(), 2u);
  run(world, 120);
  EXPECT_NEAR(world.pose(upper).position.z, 1, 0.01f);
}

TEST(World, FiltersAndTheirChangesAreObeyed) {
  World world(quiet_world());
  const BodyId floor = world.add(ground());
  BodyDef def = cube({0, 0, 1});
  def.filter = {2, 0xffffffffu};
  const BodyId id = world.add(def);
  run(world, 60);
  EXPECT_NEAR(world.pose(id).position.z, 1, 0.01f);
  world.set_filter(floor, {1, ~2u});
  run(world, 60);
  EXPECT_LT(world.pose(id).position.z, -1);
}

TEST(World, GravityScaleDampingAndMaterialMatter) {
  WorldDef def = quiet_world();
  World world(def);
  const BodyId still = world.add(cube({0, 0, 10}));
  const BodyId damped = world.add(cube({5, 0, 10}));
  world.set_gravity_scale(still, 0);
  world.set_gravity_scale(damped, 0);
  world.set_damping(damped, 1, 2);
  world.set_velocity(damped, {1, 0, 0}, {0, 0, 1});
  run(world, 60);
  EXPECT_EQ(world.pose(still).position, (Vec3{0, 0, 10}));
  EXPECT_NEAR(world.velocity(damped).linear.x, std::exp(-1.0f), 2e-3f);
  EXPECT_NEAR(world.velocity(damped).angular.z, std::exp(-2.0f), 2e-3f);
}

TEST(World, SleepsAndWakes) {
  World world(sleepy_world());
  world.add(ground());
  const BodyId a = world.add(cube({0, 0, 1}));
  const BodyId b = world.add(cube({0, 0, 2.01f}));
  const BodyId apart = world.add(cube({10, 0, 1}));
  run(world, 180);
  EXPECT_FALSE(world.is_awake(a));
  EXPECT_FALSE(world.is_awake(b));
  EXPECT_EQ(world.profile().counts.active, 0u);
  const Pose before = world.pose(b);
  run(world, 60);
  EXPECT_EQ(world.pose(b).position, before.position);
  world.apply_impulse(b, {0.5f, 0, 0});
  EXPECT_TRUE(world.is_awake(a));
  EXPECT_TRUE(world.is_awake(b));
  EXPECT_FALSE(world.is_awake(apart));
  run(world, 240);
  EXPECT_FALSE(world.is_awake(a));
  const BodyId falling = world.add(cube({10.1f, 0, 3}));
  run(world, 40);
  EXPECT_TRUE(world.is_awake(apart)) << "woken by the body that fell on it";
  EXPECT_TRUE(world.contains(falling));
}

TEST(World, KinematicLiftKeepsItsLoadAwake) {
  World world(sleepy_world());
  BodyDef lift = cube({0, 0, 0});
  lift.motion = MotionType::kinematic;
  lift.velocity.linear = {0, 0, 0.02f};
  world.add(lift);
  const BodyId load = world.add(cube({0, 0, 1}));
  run(world, 300);
  EXPECT_TRUE(world.is_awake(load));
  EXPECT_NEAR(world.pose(load).position.z, 1.1f, 0.01f);
}

TEST(World, RayCastFindsTheNearest) {
  World world(quiet_world());
  const BodyId floor = world.add(ground());
  const BodyId near = world.add(cube({2, 0, 3}));
  world.add(dynamic(sphere(0.5f), {6, 0, 3}));
  const auto hit = world.cast_ray({-2, 0, 3}, {20, 0, 0});
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit->body, near);
  EXPECT_NEAR(hit->point.x, 1.5f, 1e-5f);
  EXPECT_NEAR(hit->normal.x, -1, 1e-5f);
  EXPECT_NEAR(hit->fraction, 3.5f / 20, 1e-5f);
  const auto down = world.cast_ray({-2, 0, 3}, {0, 0, -10});
  ASSERT_TRUE(down);
  EXPECT_EQ(down->body, floor);
  EXPECT_FALSE(world.cast_ray({-2, 0, 3}, {0, 0, 10}));
  EXPECT_FALSE(world.cast_ray({-2, 0, 3}, {20, 0, 0}, {.mask = 2})) << "no body of category 2";
  world.set_pose(near, {{2, 50, 3}, 0, {}});
  EXPECT_NE(world.cast_ray({-2, 0, 3}, {20, 0, 0})->body, near) << "queries see changes at once";
}

TEST(World, OverlapQueriesFindBodies) {
  for (const BroadPhase kind : {BroadPhase::tree, BroadPhase::sweep}) {
    WorldDef def = quiet_world();
    def.broad_phase = kind;
    World world(def);
    const BodyId floor = world.add(ground());
    const BodyId a = world.add(cube({0, 0, 1.5f}));
    const BodyId b = world.add(dynamic(sphere(0.5f), {1.2f, 0, 1.5f}));
    EXPECT_THAT(world.overlap_aabb({{-1, -1, 1.2f}, {2, 1, 2}}), testing::ElementsAre(a, b));
    EXPECT_THAT(world.overlap_aabb({{-9, -9, -9}, {9, 9, 9}}), testing::ElementsAre(floor, a, b));
    EXPECT_THAT(world.overlap_shape(sphere(0.3f), {{1.8f, 0, 1.8f}, 0, {}}), testing::ElementsAre(b));
    EXPECT_THAT(world.overlap_shape(box({0.2f, 0.2f, 0.2f}), {{0.45f, 0, 1.5f}, 0, {}}), testing::ElementsAre(a));
    EXPECT_TRUE(world.cast_ray({-2, 0, 1.5f}, {4, 0, 0}));
  }
}

TEST(World, ExtremeVelocitiesNeitherCrashNorSpread) {
  World world(quiet_world());
  world.add(ground());
  const BodyId calm = world.add(cube({100, 0, 1}));
  const BodyId wild = world.add(cube({0, 0, 5}));
  world.set_velocity(wild, {1e30f, -1e30f, 1e30f}, {1e30f, 1e30f, -1e30f});
  run(world, 60);
  EXPECT_TRUE(is_finite(world.pose(calm)));
  EXPECT_NEAR(world.pose(calm).position.z, 1, 0.01f);
  EXPECT_TRUE(is_finite(world.pose(wild)));
}

TEST(World, BodyWithoutAFiniteStateIsIsolatedAndReported) {
  std::vector<std::string> lines;
  const auto simulate = [&](bool with_broken) {
    WorldDef def = quiet_world();
    if (with_broken) def.log = [&](std::string_view line) { lines.emplace_back(line); };
    World world(def);
    world.add(ground());
    std::vector<BodyId> calm;
    for (int i = 0; i < 12; ++i) calm.push_back(world.add(cube({static_cast<float>(i) * 1.5f, 0, 1.2f})));
    BodyId broken;
    if (with_broken) {
      broken = world.add(dynamic(box({0.5f, 0.5f, 0.5f}), {0, 50, 20}, 1e-30f));
      world.apply_force(broken, {1e30f, 0, 0});  // finite, but its acceleration is not
    }
    world.step();
    if (with_broken) {
      EXPECT_THAT(world.quarantined(), testing::ElementsAre(testing::Field(&Quarantine::body, broken)));
      EXPECT_EQ(world.profile().counts.quarantined, 1u);
      EXPECT_EQ(world.pose(broken).position, (Vec3{0, 50, 20}));
      EXPECT_EQ(length(world.velocity(broken).linear), 0);
      EXPECT_FALSE(world.is_awake(broken));
    }
    run(world, 60);
    if (with_broken) {
      EXPECT_TRUE(world.quarantined().empty());
      EXPECT_EQ(world.pose(broken).position, (Vec3{0, 50, 20})) << "stays where it was";
      world.set_velocity(broken, {1, 0, 0}, {});
      run(world, 30);
      EXPECT_GT(world.pose(broken).position.x, 0.4f) << "moves again once its velocity is set";
    } else {
      run(world, 30);
    }
    std::vector<Vec3> where;
    for (const BodyId id : calm) where.push_back(world.pose(id).position);
    return where;
  };
  EXPECT_EQ(simulate(true), simulate(false)) << "the rest of the world is exactly as without it";
  ASSERT_EQ(lines.size(), 1u);
  EXPECT_THAT(lines[0], HasSubstr("was not finite"));
}

TEST(World, BodiesCanComeAndGoAtAnyTime) {
  World world(quiet_world(2));
  world.add(ground());
  std::vector<BodyId> ids;
  std::uint32_t seed = 5;
  const auto random = [&] { return (seed = seed * 1664525u + 1013904223u) >> 8; };
  for (int i = 0; i < 400; ++i) {
    if (ids.size() < 60 || random() % 2) {
      const Vec3 p{static_cast<float>(random() % 64) / 8, static_cast<float>(random() % 64) / 8,
                   2 + static_cast<float>(random() % 64) / 8};
      ids.push_back(world.add(random() % 2 ? cube(p) : dynamic(capsule(0.3f, 0.3f), p)));
    } else {
      const std::size_t k = random() % ids.size();
      world.remove(ids[k]);
      ids.erase(ids.begin() + static_cast<std::ptrdiff_t>(k));
    }
    world.step();
    ASSERT_EQ(world.body_count(), ids.size() + 1);
  }
  for (const BodyId id : ids) EXPECT_TRUE(is_finite(world.pose(id)));
}

TEST(World, ContactsCanBeRead) {
  World world(quiet_world());
  const BodyId floor = world.add(ground());
  const BodyId id = world.add(cube({0, 0, 1}));
  run(world, 60);
  int contacts = 0;
  world.for_each_contact([&](const ContactInfo& c) {
    ++contacts;
    EXPECT_EQ(c.a, floor);
    EXPECT_EQ(c.b, id);
    EXPECT_NEAR(c.normal.z, 1, 1e-5f);
    EXPECT_EQ(c.point_count, 4);
    float impulse = 0;
    for (int p = 0; p < c.point_count; ++p) {
      impulse += c.points[p].impulse;
      EXPECT_NEAR(c.points[p].position.z, 0.5f, 1e-3f);
      EXPECT_NEAR(std::abs(c.points[p].position.x), 0.5f, 1e-3f);
    }
    EXPECT_NEAR(impulse * 60, 9.81f, 0.05f);
  });
  EXPECT_EQ(contacts, 1);
}

TEST(World, ShiftingTheOriginDisturbsNothing) {
  World world(quiet_world());
  const Vec3 far{40000, -20000, 10000};
  BodyDef floor = ground();
  floor.pose.position = far;
  world.add(floor);
  std::vector<BodyId> tower;
  for (int i = 0; i < 6; ++i) tower.push_back(world.add(cube(far + Vec3{0, 0, 1.0f + static_cast<float>(i)})));
  run(world, 120);
  std::vector<Vec3> before;
  for (const BodyId id : tower) before.push_back(world.pose(id).position - far);
  world.shift_origin(far);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(world.pose(tower[i]).position, before[i]) << "exact: " << i;
  const auto hit = world.cast_ray({0, 0, 20}, {0, 0, -30});
  ASSERT_TRUE(hit.has_value());
  EXPECT_EQ(hit->body, tower.back());
  for (int i = 0; i < 120; ++i) {
    world.step();
    EXPECT_EQ(world.contacts_begun().size() + world.contacts_ended().size(), 0u) << "step " << i;
  }
  for (int i = 0; i < 6; ++i) EXPECT_LT(distance(world.pose(tower[i]).position, before[i]), 2e-3f);
  expect_error(ErrorCode::invalid_argument, "origin", [&] { world.shift_origin({nan, 0, 0}); });
  expect_error(ErrorCode::invalid_argument, "shift the origin", [&] {
    world.shift_origin({-3e38f, 0, 0});
    world.shift_origin({-3e38f, 0, 0});
  });
}

TEST(World, SettersRefuseNonFiniteValues) {
  World world(quiet_world());
  const BodyId id = world.add(cube({0, 0, 1}));
  expect_error(ErrorCode::invalid_argument, "position", [&] { world.set_pose(id, {{nan, 0, 0}, 0, {}}); });
  expect_error(ErrorCode::invalid_argument, "velocity", [&] { world.set_velocity(id, {nan, 0, 0}, {}); });
  expect_error(ErrorCode::invalid_argument, "friction", [&] { world.set_material(id, {-1, 0}); });
  expect_error(ErrorCode::invalid_argument, "gravity", [&] { world.set_gravity({0, nan, 0}); });
  EXPECT_EQ(world.pose(id).position, (Vec3{0, 0, 1}));
}

}  // namespace
}  // namespace fathom::test::world_test
