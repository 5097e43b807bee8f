// Joints: pendulums against their equations of motion, chains under loads, nets, momentum, and random mechanisms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "scene/random.hpp"
#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr float link_length = 0.2f;  // m
const Vec3 link_end{0, 0, 0.5f * link_length};

/// The device simulator moves bodies by their latest velocity alone, so its swings are of first order.
bool is_of_second_order(const Setup& setup) { return setup.simulator != SimulatorKind::device; }
const char* const torn_apart = "one in a hundred with loops between light bodies on long arms parts and gains energy";

std::string text(double value) {
  char digits[32];
  std::snprintf(digits, sizeof digits, "%.3g", value);
  return digits;
}

BodyId add_post(World& world, Vec3 position) {
  BodyDef post;
  post.motion = MotionType::fixed;
  post.shape = sphere(0.01f);
  post.pose.position = position;
  return world.add(post);
}

double widest_gap(const World& world) {
  float widest = 0;
  for (const JointId id : world.joints()) {
    const JointDef& joint = world.joint(id);
    widest = max(widest, distance(transform(world.pose(joint.a), joint.frame_a.position),
                                  transform(world.pose(joint.b), joint.frame_b.position)));
  }
  return wide(widest);
}

double total_energy(const World& world) {
  double sum = 0;
  for (const BodyId id : world.bodies())
    if (world.motion(id) == MotionType::dynamic) sum += energy(world, id);
  return sum;
}

/// Links along −z from `top`, joined to the first link at its centre.
std::vector<BodyId> add_chain(World& world, BodyId top, int count, float mass) {
  std::vector<BodyId> links;
  const Vec3 from = world.pose(top).position;
  for (int i = 0; i < count; ++i) {
    const Vec3 position = from - (static_cast<float>(i) + 0.5f) * Vec3{0, 0, link_length};
    links.push_back(world.add(body(capsule(0.02f, 0.07f), position, mass)));
    if (i == 0)
      world.add_joint(ball_joint(top, links[0], {}, link_end));
    else
      world.add_joint(ball_joint(links[links.size() - 2], links.back(), -link_end, link_end));
  }
  return links;
}

/// Angle of a pendulum after each step, by the classical Runge-Kutta method: θ″ = −k sin θ.
class ExactPendulum {
 public:
  ExactPendulum(double angle, double k) : angle_(angle), k_(k) {}
  double after(double dt) {
    constexpr int parts = 20;
    const double h = dt / parts;
    for (int i = 0; i < parts; ++i) {
      const double a1 = spin_, s1 = force(angle_);
      const double a2 = spin_ + 0.5 * h * s1, s2 = force(angle_ + 0.5 * h * a1);
      const double a3 = spin_ + 0.5 * h * s2, s3 = force(angle_ + 0.5 * h * a2);
      const double a4 = spin_ + h * s3, s4 = force(angle_ + h * a3);
      angle_ += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
      spin_ += h / 6 * (s1 + 2 * s2 + 2 * s3 + s4);
    }
    return angle_;
  }

 private:
  double force(double angle) const { return -k_ * std::sin(angle); }
  double angle_, k_, spin_ = 0;
};

/// A tree of capsules and balls of random sizes in the air. With `loops`, some bodies have an extra joint. Bodies do
/// not collide with each other, because they may overlap at the start.
void add_random_mechanism(World& world, Random& random, bool loops) {
  const auto number = [&](double low, double high) {
    return narrow(low + (high - low) * (0.5 + random.symmetric(0.5)));
  };
  const int count = 3 + static_cast<int>(number(0, 20));
  std::vector<BodyId> ids;
  for (int i = 0; i < count; ++i) {
    const Shape shape = number(0, 1) < 0.5f ? sphere(number(0.05, 0.2)) : capsule(number(0.03, 0.1), number(0.05, 0.2));
    Vec3 position{0, 0, 8};  // no body starts below the floor
    const std::size_t parent = ids.empty() ? 0 : static_cast<std::size_t>(number(0, wide(narrow(i)) - 0.01));
    if (i > 0)
      position = world.pose(ids[parent]).position + Vec3{number(-0.5, 0.5), number(-0.5, 0.5), number(-0.3, 0.5)};
    BodyDef def = body(shape, position, number(0.5, 5));
    def.filter = {2, ~2u};
    ids.push_back(world.add(def));
    const auto join = [&](BodyId a, BodyId b) {
      const Vec3 half = 0.5f * (world.pose(b).position - world.pose(a).position);
      world.add_joint(ball_joint(a, b, half, -half));
    };
    if (i > 0) join(ids[parent], ids.back());
    if (loops && i > 2 && number(0, 1) < 0.15f && parent != 0) join(ids[0], ids.back());
  }
}

struct Tumble {
  std::uint64_t hash = 0;
  double gain = 0, gap = 0;  // fraction of the initial energy; m, at the end
  bool finite = true;
};

Tumble tumble(const Setup& setup, std::uint64_t seed, int threads, bool loops) {
  Setup with = setup;
  with.threads = threads;
  World world(world_def(with));
  world.add(floor_slab());
  Random random(seed);
  add_random_mechanism(world, random, loops);
  const double start = total_energy(world);
  Tumble result;
  for (int i = 0; i < 300; ++i) {
    world.step();
    result.gain = std::max(result.gain, total_energy(world) / start - 1);
  }
  result.hash = world.state_hash();
  result.gap = widest_gap(world);
  result.finite = all_finite(world);
  return result;
}

}  // namespace

void joint_pendulum(const Setup& setup, Record& record) {
  Table table{"A pendulum of 1 m over 10 periods", {"amplitude (rad)", "angle, largest error (%)", "energy (%)"}, {}};
  for (const double amplitude : {0.1, 1.0}) {
    World world(world_def(setup));
    const BodyId post = add_post(world, {});
    const Vec3 out{narrow(std::sin(amplitude)), 0, narrow(-std::cos(amplitude))};
    const BodyId bob = world.add(body(sphere(0.1f), out));
    world.add_joint(ball_joint(post, bob, {}, -out));
    ExactPendulum exact(amplitude, g / (1 + 0.4 * 0.01));
    const double start = energy(world, bob), depth = 1 - std::cos(amplitude);
    const double period = 2.007 * (1 + amplitude * amplitude / 16);
    double error = 0, drift = 0;
    for (int i = step_count(world, 10 * period); i > 0; --i) {
      world.step();
      const Vec3 p = world.pose(bob).position;
      error = std::max(error, std::abs(std::atan2(wide(p.x), -wide(p.z)) - exact.after(wide(world.definition().dt))));
      drift = std::max(drift, std::abs(energy(world, bob) - start) / (g * depth));
    }
    table.rows.push_back({text(amplitude), text(100 * error / amplitude), text(100 * drift)});
    const std::string name = " at " + text(amplitude) + " rad";
    record.at_most("error of the angle" + name, 100 * error / amplitude, is_of_second_order(setup) ? 0.3 : 1.5, "%");
    record.at_most("change of energy" + name, 100 * drift, is_of_second_order(setup) ? 0.1 : 3, "%");
  }
  record.tables.push_back(std::move(table));
}

void joint_double_pendulum(const Setup& setup, Record& record) {
  for (const bool rods : {true, false}) {
    World world(world_def(setup));
    BodyId before = add_post(world, {});
    Vec3 on_before{};
    for (int i = 0; i < 2; ++i) {
      // A rod, or a small ball at the distance of a rod's length.
      BodyDef def = body(rods ? capsule(0.05f, 0.45f) : sphere(0.1f), {narrow(i) + (rods ? 0.5f : 1.0f), 0, 0});
      if (rods) def.pose.rotation = turn_about({0, 1, 0}, 1.5707963);
      def.filter.mask = 0;  // lets the second one pass the post
      const BodyId bob = world.add(def);
      world.add_joint(ball_joint(before, bob, on_before, rods ? Vec3{0, 0, -0.5f} : Vec3{-1, 0, 0}));
      before = bob, on_before = rods ? Vec3{0, 0, 0.5f} : Vec3{};
    }
    const double start = total_energy(world), fall = (rods ? 2 : 3) * g;
    double least = start, most = start;
    for (int i = step_count(world, setup.full ? 60 : 20); i > 0; --i) {
      world.step();
      least = std::min(least, total_energy(world)), most = std::max(most, total_energy(world));
    }
    const std::string which = rods ? " by two rods" : " by two balls of 10 cm on arms of 1 m";
    record.at_most("energy gained" + which + ", of what the fall gives", 100 * (most - start) / fall, 2, "%");
    record.at_most("energy lost" + which, 100 * (start - least) / fall, 5, "%");
  }
}

void joint_heavy_chain(const Setup& setup, Record& record) {
  World world(world_def(setup));
  const std::vector<BodyId> links = add_chain(world, add_post(world, {}), 50, 1);
  const float radius = 0.5f;
  const BodyId load =
      world.add(body(sphere(radius), world.pose(links.back()).position - link_end - Vec3{0, 0, radius}, 1000.0f));
  world.add_joint(ball_joint(links.back(), load, -link_end, {0, 0, radius}));
  double gap = 0;
  for (int i = step_count(world, 10); i > 0; --i) {
    world.step();
    gap = std::max(gap, widest_gap(world));
  }
  record.at_most("widest gap of 50 links of 1 kg under 1,000 kg", 1e3 * gap, 0.1, "mm");
}

void joint_net(const Setup& setup, Record& record) {
  constexpr int side = 20;
  World world(world_def(setup));
  std::vector<BodyId> ids;
  for (int i = 0; i < side * side; ++i) {
    const Vec3 position{narrow(i % side), 0, narrow(-(i / side))};
    ids.push_back(i < side ? add_post(world, position) : world.add(body(sphere(0.4f), position)));
    if (i < side) continue;
    world.add_joint(ball_joint(ids[ids.size() - 1 - side], ids.back(), {0, 0, -0.5f}, {0, 0, 0.5f}));
    if (i % side > 0) world.add_joint(ball_joint(ids[ids.size() - 2], ids.back(), {0.5f, 0, 0}, {-0.5f, 0, 0}));
  }
  steps(world, step_count(world, 10));
  double fastest = 0;
  for (const BodyId id : ids) fastest = std::max(fastest, speed(world, id));
  record.at_most("widest gap of a net of 20 × 20 that hangs for 10 s", 1e3 * widest_gap(world), 10, "mm");
  record.at_most("its fastest body", fastest, 0.05, "m/s");
}

void joint_momentum(const Setup& setup, Record& record) {
  WorldDef def = world_def(setup);
  def.gravity = {};
  World world(def);
  Random random(3);
  add_random_mechanism(world, random, false);
  double mass = 0;
  Vec3 push{1, 2, 0.5f};
  for (const BodyId id : world.bodies()) {
    world.set_velocity(id, push, {0, 0, 2});
    push = {push.z, push.x, push.y};
    mass += wide(world.mass(id));
  }
  const auto momentum = [&] {
    Vec3d sum{};
    for (const BodyId id : world.bodies()) sum += wide(world.mass(id)) * to_double(world.velocity(id).linear);
    return sum;
  };
  const Vec3d before = momentum();
  steps(world, 600);
  record.at_most("drift of the momentum over 10 s, as a speed of the whole", length(momentum() - before) / mass, 5e-4,
                 "m/s");
}

void joint_mechanisms(const Setup& setup, Record& record) {
  const int seeds = setup.full ? 40 : 8;
  for (const bool loops : {false, true}) {
    int other_hashes = 0, not_finite = 0;
    int torn = 0;
    double gain = 0, gap = 0;
    for (int i = 1; i <= seeds; ++i) {
      const auto seed = static_cast<std::uint64_t>(i);
      const Tumble one = tumble(setup, seed, 1, loops);
      for (const int threads : {2, 4}) other_hashes += tumble(setup, seed, threads, loops).hash != one.hash;
      not_finite += !one.finite;
      gain = std::max(gain, one.gain);
      gap = std::max(gap, one.gap);
      torn += one.gap > 0.02;
    }
    const std::string which = loops ? ", loops" : ", trees";
    record.at_most("mechanisms of " + std::to_string(seeds) + which + ", with other states on 2 or 4 threads",
                   other_hashes, 0);
    record.at_most("with states that are not finite" + which, not_finite, 0);
    const std::string known = loops ? torn_apart : "";
    record.at_most("most energy gained" + which, 100 * gain, 2, "%").known = known;
    record.at_most("of them torn by more than 20 mm after 5 s" + which, torn, 0).known = known;
    record.at_most("widest gap after 5 s" + which, 1e3 * gap, 20, "mm").known = known;
  }
}

namespace {

/// The highest energy, as a fraction of the initial energy, if the wall is `further` (m) away.
double energy_at_a_wall(const Setup& setup, float further) {
  World world(world_def(setup));
  world.add(floor_slab());
  const BodyId post = add_post(world, {0, 0, 7.5f});
  BodyId before = post;
  Vec3 on_before{};
  for (int i = 0; i < 12; ++i) {
    BodyDef link = body(capsule(0.06f, 0.19f), {-0.25f - 0.5f * narrow(i), 0, 7.5f}, 2.0f);
    link.pose.rotation = turn_about({0, 1, 0}, 1.5707963);
    const BodyId id = world.add(link);
    world.add_joint(ball_joint(before, id, on_before, {0, 0, 0.25f}));
    before = id, on_before = {0, 0, -0.25f};
  }
  const BodyId ball = world.add(body(sphere(0.6f), {-6.6f, 0, 7.5f}, 500.0f));
  world.add_joint(ball_joint(before, ball, on_before, {0.6f, 0, 0}));
  for (int i = 0; i < 20; ++i)
    world.add(
        body(box({0.4f, 0.4f, 0.4f}), {1.2f + further, 0.82f * narrow(i % 5 - 2), 0.4f + 0.8f * narrow(i / 5)}, 60.0f));
  const double start = total_energy(world);
  double most = 0;
  for (int i = step_count(world, 20); i > 0; --i) {
    world.step();
    most = std::max(most, total_energy(world) / start);
  }
  return most;
}

}  // namespace

// The motion after the hit is chaotic, so one wall says little: ten walls, 1 cm apart.
void joint_wedged(const Setup& setup, Record& record) {
  constexpr int walls = 10;
  int gained = 0;
  double most = 0;
  for (int i = 0; i < walls; ++i) {
    const double energy = energy_at_a_wall(setup, 0.01f * narrow(i));
    gained += energy > 1.02;
    most = std::max(most, energy);
  }
  record.at_most("balls of 500 kg on links of 2 kg that gain energy among crates, of 10", gained, 0);
  record.at_most("most energy of any of them, of the start's", most, 1.02);
}

}  // namespace fathom::validate
