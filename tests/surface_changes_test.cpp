// Pairs with surfaces as an application sees them: events of the pair, surfaces that come and go, every way of solving.
#include <gtest/gtest.h>

#include <fathom/compound.hpp>
#include <functional>
#include <set>
#include <span>
#include <utility>

#include "test_surfaces.hpp"
#include "world_fixture.hpp"

namespace fathom::test::surface_changes_test {
namespace {

using TouchingPair = std::pair<std::uint32_t, std::uint32_t>;

TouchingPair pair_of(BodyId a, BodyId b) { return std::minmax(a.index, b.index); }

/// A pair begins to touch once and ends once, however many contacts it has.
TEST(SurfaceChanges, EventsAreOfPairs) {
  WorldDef def = sleepy_world();
  def.sleep.enabled = false;
  World world(def);
  world.add(fixed(wavy_mesh(60)));
  for (const BodyDef& body : mixed_bodies(80)) world.add(body);
  std::set<TouchingPair> touching;
  int begun = 0, ended = 0;
  for (int step = 0; step < 400; ++step) {
    world.step();
    for (const ContactEvent& event : world.contacts_ended()) {
      EXPECT_EQ(touching.erase(pair_of(event.a, event.b)), 1u) << "ended twice, or never begun";
      ++ended;
    }
    for (const ContactEvent& event : world.contacts_begun()) {
      EXPECT_TRUE(touching.insert(pair_of(event.a, event.b)).second) << "begun twice";
      ++begun;
    }
  }
  EXPECT_GT(begun, 200);
  EXPECT_GT(ended, 50);
  std::set<TouchingPair> in_contact;
  world.for_each_contact([&](const ContactInfo& c) { in_contact.insert(pair_of(c.a, c.b)); });
  for (const TouchingPair& pair : touching) EXPECT_TRUE(in_contact.contains(pair));
}

TEST(SurfaceChanges, WhoLiesOnASurfaceThatGoesFalls) {
  World world;
  const BodyId ground = world.add(fixed(wavy_mesh(60)));
  std::vector<BodyId> ids;
  for (const BodyDef& body : mixed_bodies(40)) ids.push_back(world.add(body));
  run(world, 900);
  std::set<TouchingPair> touched;
  world.for_each_contact([&](const ContactInfo& c) {
    if (c.a == ground || c.b == ground) touched.insert(pair_of(c.a, c.b));
  });
  EXPECT_GT(touched.size(), 10u);
  world.remove(ground);
  run(world, 60);
  for (const BodyId id : ids) EXPECT_LT(world.velocity(id).linear.z, -5) << id.index;
  // Another one catches them.
  world.add(fixed(wavy_field(61), {-5, -5, -12}));
  run(world, 600);
  int caught = 0;
  for (const BodyId id : ids) caught += world.pose(id).position.z > -14;
  EXPECT_GT(caught, 30);
}

TEST(SurfaceChanges, BodiesComeAndGo) {
  World world;
  world.add(fixed(wavy_mesh(80)));
  const std::vector<BodyDef> bodies = mixed_bodies(50);
  std::vector<BodyId> ids;
  for (const BodyDef& body : bodies) ids.push_back(world.add(body));
  for (int step = 0; step < 1500; ++step) {
    if (step % 3 == 0) {
      const std::size_t i = static_cast<std::size_t>(step) / 3 * 7 % ids.size();
      world.remove(ids[i]);
      ids[i] = world.add(bodies[i]);
    }
    world.step();
    ASSERT_TRUE(world.quarantined().empty());
  }
  run(world, 200);
  for (const BodyId id : ids) {
    const Vec3 p = world.pose(id).position;
    EXPECT_GT(p.z, wavy_bowl(p.x, p.y) - 0.05f) << id.index;
  }
}

/// A snapshot between a change of shape and the next step holds contacts of the former shape.
TEST(SurfaceChanges, SnapshotsHoldChangesThatWait) {
  const std::vector<ChildShape> children{{.shape = sphere(0.3f)}, {.shape = sphere(0.3f), .pose = {{0.5f, 0, 0}, {}}}};
  const std::function<void(World&, BodyId, BodyId)> changes[] = {
      [](World& world, BodyId ground, BodyId) { world.set_shape(ground, wavy_mesh(7)); },
      [](World& world, BodyId ground, BodyId) {
        world.set_shape(ground, box({5, 5, 0.1f}));
      },
      [](World& world, BodyId ground, BodyId) { world.remove(ground); },
      [](World& world, BodyId, BodyId pair) { world.set_shape(pair, sphere(0.4f)); },
      [&](World& world, BodyId, BodyId pair) { world.set_shape(pair, compound(std::span(children).first(1))); },
      [](World& world, BodyId, BodyId pair) { world.remove(pair); },
  };
  for (const auto& change : changes) {
    World world(sleepy_world());
    const BodyId ground = world.add(fixed(wavy_mesh(30)));
    for (const BodyDef& body : mixed_bodies(20)) world.add(body);
    const BodyId pair = world.add(dynamic(compound(children), {0, 0, 1}));
    run(world, 60);
    change(world, ground, pair);
    World copy(sleepy_world());
    copy.restore(saved(world));
    for (int i = 0; i < 30; ++i) {
      run(world, 1), run(copy, 1);
      ASSERT_EQ(world.state_hash(), copy.state_hash()) << &change - changes << ", step " << i;
    }
  }
}

/// No simulator setting lets a body fall through.
TEST(SurfaceChanges, EveryWayOfSolvingHolds) {
  const std::pair<const char*, std::function<void(WorldDef&)>> ways[] = {
      {"four threads", [](WorldDef& def) { def.threads = 4; }},
      {"impulse", [](WorldDef& def) { def.solver.method = Solver::impulse; }},
      {"one substep", [](WorldDef& def) { def.solver.substeps = 1; }},
      {"hybrid", [](WorldDef& def) { def.simulator = SimulatorKind::hybrid, def.device = "host"; }},
      {"device", [](WorldDef& def) { def.simulator = SimulatorKind::device, def.device = "host"; }},
      {"device's cells",
       [](WorldDef& def) {
         def.simulator = SimulatorKind::device, def.device = "host", def.partition = Partition::cells;
       }},
      {"device's sweep",
       [](WorldDef& def) {
         def.simulator = SimulatorKind::device, def.device = "host", def.broad_phase = BroadPhase::sweep;
       }},
      {"device's impulse",
       [](WorldDef& def) {
         def.simulator = SimulatorKind::device, def.device = "host", def.solver.method = Solver::impulse;
       }},
      {"long steps", [](WorldDef& def) { def.dt = 1.0f / 30; }},
      {"short steps", [](WorldDef& def) { def.dt = 1.0f / 240; }},
  };
  for (const auto& [name, choose] : ways)
    for (const bool field : {false, true}) {
      WorldDef def;
      choose(def);
      World world(def);
      world.add(field ? fixed(wavy_field(41), {-5, -5, 0}) : fixed(wavy_mesh(40)));
      std::vector<BodyId> ids;
      for (const BodyDef& body : mixed_bodies(40)) ids.push_back(world.add(body));
      run(world, static_cast<int>(6 / def.dt));
      EXPECT_TRUE(world.quarantined().empty()) << name;
      for (const BodyId id : ids) {
        const Vec3 p = world.pose(id).position;
        EXPECT_GT(p.z, wavy_bowl(p.x, p.y) - 0.05f) << name << (field ? ", field, " : ", mesh, ") << id.index;
      }
    }
}

}  // namespace
}  // namespace fathom::test::surface_changes_test
