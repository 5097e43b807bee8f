// SimBenchmark (ETH Zürich, github.com/leggedrobotics/SimBenchmark): five scenes by the makers of RaiSim, published
// with results of RaiSim, ODE, Bullet, DART and MuJoCo (data/*/sample.csv; without error reduction, the best of each
// engine's solvers). As there, states are sampled before each step. Our step is the published time step, with the
// default four substeps.
// step with the default four substeps.
#include <chrono>
#include <cmath>
#include <cstdio>

#include "scene/random.hpp"
#include "validate/bodies.hpp"
#include "validate/case_list.hpp"

namespace fathom::validate {
namespace {

constexpr float ball_radius = 0.1f, ball_mass = 10;

std::string figure(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Restitution at any speed, and contacts as stiff as the time step allows, as in the engines compared.
WorldDef benchmark_def(const Setup& setup, float dt) {
  WorldDef def = world_def(setup);
  def.dt = dt;
  def.solver.restitution_threshold = 0;
  def.solver.contact_hertz = 1000;  // limited by the substep rate
  return def;
}

double total_energy(const World& world, const std::vector<BodyId>& ids) {
  double sum = 0;
  for (const BodyId id : ids) sum += energy(world, id);
  return sum;
}

struct Mean {
  double sum = 0;
  int count = 0;
  void add(double value) { sum += value, ++count; }
  double value() const { return sum / count; }
};

/// Balls in a 6 × 6 × 6 block over a frictionless floor, each slightly displaced.
std::vector<BodyId> add_666(World& world, double height, float restitution) {
  const Material material{0, restitution};
  world.add(floor_slab(material));
  Random random(42);
  const auto position = [&](int i) { return 0.21 * i + 0.001 * (0.5 + random.symmetric(0.5)); };
  std::vector<BodyId> ids;
  for (int i = 0; i < 216; ++i) {
    const double x = position(i / 36), y = position(i / 6 % 6), z = position(i % 6) + height;
    ids.push_back(world.add(body(sphere(ball_radius), {narrow(x), narrow(y), narrow(z)}, ball_mass, material)));
  }
  return ids;
}

double squared_penetration(const World& world, const std::vector<BodyId>& ids) {
  double sum = 0;
  const double reach = 2 * wide(ball_radius);
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const Vec3d p = to_double(world.pose(ids[i]).position);
    if (p.z < wide(ball_radius)) sum += (wide(ball_radius) - p.z) * (wide(ball_radius) - p.z);
    for (std::size_t k = i + 1; k < ids.size(); ++k) {
      const Vec3d d = to_double(world.pose(ids[k]).position) - p;
      if (const double square = dot(d, d); square < reach * reach) {
        const double depth = reach - std::sqrt(square);
        sum += depth * depth;
      }
    }
  }
  return sum;
}

}  // namespace

void bouncing(const Setup& setup, Record& record) {
  Table table{"Mean squared energy error (J²), 49 balls of 10 kg from 5 m, e = 1, 20 s",
              {"Δt (s)", "Fathom", "RaiSim", "ODE", "DART", "Bullet"},
              {}};
  Plot plot{"Bouncing: energy error", "t (s)", "E − E₀ (J)", false, false, {}};
  const auto simulate = [&](float dt) {
    World world(benchmark_def(setup, dt));
    const Material material{0, 1};
    world.add(floor_slab(material));
    std::vector<BodyId> ids;
    for (int i = 0; i < 49; ++i)
      ids.push_back(
          world.add(body(sphere(ball_radius), {2.0f * static_cast<float>(i / 7), 2.0f * static_cast<float>(i % 7), 5},
                         ball_mass, material)));
    const double start = 49 * wide(ball_mass) * g * 5;
    Mean mean;
    Curve curve{"Δt = " + figure(wide(dt)) + " s", {}, {}};
    const int count = step_count(world, 20);
    for (int i = 0; i < count; ++i) {
      const double error = total_energy(world, ids) - start;
      mean.add(error * error);
      if (i % (count / 400) == 0) curve.add(wide(dt) * i, error);
      world.step();
    }
    plot.curves.push_back(std::move(curve));
    return mean.value();
  };
  const double coarse = simulate(0.01f), fine = simulate(0.001f);
  table.rows.push_back({"0.001", figure(fine), "0.0186", "185", "72,274", "75,245"});
  table.rows.push_back({"0.01", figure(coarse), "186", "18,808", "7.38e6", "7.41e6"});
  record.at_most("mean squared energy error, Δt 1 ms (best: RaiSim)", fine, 0.0186, "J²");
  record.at_most("the same, Δt 10 ms (best: RaiSim)", coarse, 186, "J²");
  record.tables.push_back(std::move(table));
  record.plots.push_back(std::move(plot));
}

void spheres_666(const Setup& setup, Record& record) {
  const auto simulate = [&](float dt) {
    World world(benchmark_def(setup, dt));
    const std::vector<BodyId> ids = add_666(world, 0.101, 0);
    Mean mean;
    for (int i = 0; i < step_count(world, 10); ++i) {
      mean.add(squared_penetration(world, ids));
      world.step();
    }
    return mean.value();
  };
  Table table{"Mean Σ penetration² (m²), 216 balls, e = 0, 10 s",
              {"Δt (s)", "Fathom", "RaiSim", "ODE", "DART", "MuJoCo", "Bullet"},
              {}};
  const double coarse = simulate(0.01f);
  record.at_most("mean Σ penetration², Δt 10 ms (best: RaiSim)", coarse, 0.0153, "m²");
  if (setup.full) {
    const double fine = simulate(0.001f);
    record.at_most("the same, Δt 1 ms (best: RaiSim)", fine, 1.353e-4, "m²");
    table.rows.push_back({"0.001", figure(fine), "1.35e-4", "1.55e-4", "2.82e-4", "0.0950", "0.382"});
  }
  table.rows.push_back({"0.01", figure(coarse), "0.0153", "0.0161", "215", "0.933", "37.4"});
  record.tables.push_back(std::move(table));
}

void elastic_666(const Setup& setup, Record& record) {
  Plot plot{"Elastic 666: energy error", "t (s)", "E − E₀ (J)", false, false, {}};
  const auto simulate = [&](float dt) {
    World world(benchmark_def(setup, dt));
    const std::vector<BodyId> ids = add_666(world, 1.101, 1);
    const double start = total_energy(world, ids);
    Mean mean;
    Curve curve{"Δt = " + figure(wide(dt)) + " s", {}, {}};
    const int count = step_count(world, 10);
    for (int i = 0; i < count; ++i) {
      const double error = total_energy(world, ids) - start;
      mean.add(error * error);
      if (i % (count / 200) == 0) curve.add(wide(dt) * i, error);
      world.step();
    }
    plot.curves.push_back(std::move(curve));
    return mean.value();
  };
  Table table{"Mean squared energy error (J²), 216 balls, e = 1, 10 s",
              {"Δt (s)", "Fathom", "RaiSim", "ODE", "Bullet", "DART"},
              {}};
  const double coarse = simulate(0.01f);
  record.at_most("mean squared energy error, Δt 10 ms (best: RaiSim)", coarse, 5.18e6, "J²");
  if (setup.full) {
    const double middle = simulate(0.004f), fine = simulate(0.001f);
    record.at_most("the same, Δt 4 ms (best: RaiSim)", middle, 264, "J²");
    record.at_most("the same, Δt 1 ms (best: RaiSim)", fine, 8.37, "J²");
    table.rows.push_back({"0.001", figure(fine), "8.37", "112", "41,498", "3.46e5"});
    table.rows.push_back({"0.004", figure(middle), "264", "1,648", "8.4e5", "6.6e6"});
  }
  table.rows.push_back({"0.01", figure(coarse), "5.18e6", "8.56e6", "9.86e6", "1.29e10"});
  record.tables.push_back(std::move(table));
  record.plots.push_back(std::move(plot));
}

void rolling(const Setup& setup, Record& record) {
  // Exact solution: friction µ1 under the plate, on which the balls roll (SimBenchmark, RollingBenchmark.hpp).
  const double slow = 0.4 * (10 + 25) * g, ball_force = (150 - slow) / 10 / (3.5 + 25.0 / 10);
  const double plate_acceleration = (150 - slow - 25 * ball_force) / 10, ball_acceleration = ball_force;
  const double direction[2][2] = {{0.5, 0.866025403784439}, {0, 1}};
  Table table{"Mean squared velocity error (m²/s²) of plate and ball, Δt 1 ms, 4 s",
              {"push", "Fathom", "Bullet", "RaiSim", "MuJoCo", "ODE"},
              {}};
  Plot plot{"Rolling: speed along an oblique push", "t (s)", "m/s", false, false, {}};
  for (int push = 0; push < 2; ++push) {
    World world(benchmark_def(setup, 0.001f));
    const auto multiplied = [](float friction) {
      Material m{friction, 0};
      m.friction_rule = CombineRule::multiply;
      return m;
    };
    constexpr float overlap = 2e-5f;
    world.add(floor_slab(multiplied(0.5f)));
    const BodyId plate = world.add(body(box({10, 10, 0.5f}), {0, 0, 0.5f - overlap}, 10, multiplied(0.8f)));
    std::vector<BodyId> balls;
    for (int i = 0; i < 25; ++i)
      balls.push_back(world.add(
          body(sphere(0.5f),
               {2.0f * static_cast<float>(i / 5) - 4, 2.0f * static_cast<float>(i % 5) - 4, 1.5f - 3 * overlap}, 1,
               multiplied(1.0f))));
    const double x = direction[push][0], y = direction[push][1];
    const auto squared_error = [&](BodyId id, double expected) {
      const Vec3d v = to_double(world.velocity(id).linear), e = v - expected * Vec3d{x, y, 0};
      return dot(e, e);
    };
    Mean mean;
    Curve plate_curve{"plate", {}, {}}, ball_curve{"ball", {}, {}}, exact_plate{"plate, exact", {}, {}},
        exact_ball{"ball, exact", {}, {}};
    for (int i = 0; i < 4000; ++i) {
      const double t = 0.001 * i;
      world.apply_force(plate, {narrow(150 * x), narrow(150 * y), 0});
      mean.add(squared_error(plate, plate_acceleration * t) + squared_error(balls[0], ball_acceleration * t));
      if (i % 40 == 0) {
        plate_curve.add(t, speed(world, plate)), ball_curve.add(t, speed(world, balls[0]));
        exact_plate.add(t, plate_acceleration * t), exact_ball.add(t, ball_acceleration * t);
      }
      world.step();
    }
    if (push == 0) {
      plot.curves = {plate_curve, ball_curve, exact_plate, exact_ball};
      record.at_most("oblique push, mean squared velocity error (best single precision or soft: RaiSim)", mean.value(),
                     4.09e-7, "m²/s²");
      table.rows.push_back({"oblique", figure(mean.value()), "3.9e-27", "4.09e-7", "2.05e-3", "3.14"});
    } else {
      record.at_most("push along y, the same", mean.value(), 4.08e-7, "m²/s²");
      table.rows.push_back({"along y", figure(mean.value()), "7.3e-28", "4.08e-7", "2.19e-3", "7.6e-9"});
    }
  }
  record.tables.push_back(std::move(table));
  record.plots.push_back(std::move(plot));
}

void kapla(const Setup& setup, Record& record) {
  World world(benchmark_def(setup, 0.01f));
  const Material material{0.8f, 0};  // RaiSim's default
  world.add(floor_slab(material));
  const Shape base = box({0.025f, 0.125f, 0.05f}), wall = box({0.1f, 0.025f, 0.05f});
  BodyId last;
  for (int storey = 0; storey < 6; ++storey) {
    const float z = 0.2f * static_cast<float>(storey);
    for (int i = 0; i < 8; ++i) world.add(body(base, {0.2f * static_cast<float>(i), 0, z + 0.05f}, 10, material));
    for (const float x : {0.1f, 0.5f, 0.9f, 1.3f}) world.add(body(wall, {x, -0.1f, z + 0.15f}, 10, material));
    for (const float x : {0.3f, 0.7f, 1.1f, 0.1f, 1.3f})
      last = world.add(body(wall, {x, 0.1f, z + 0.15f}, 10, material));
  }
  Plot plot{"Kapla: height of the last block", "t (s)", "m", false, false, {}};
  Curve& curve = plot.curves.emplace_back(Curve{"Fathom", {}, {}});
  const int most = setup.full ? 60000 : 3000;
  int stood = 0;
  const auto start = std::chrono::steady_clock::now();
  while (stood < most && world.pose(last).position.z >= 1.0f) {
    if (stood % (most / 200) == 0) curve.add(0.01 * stood, wide(world.pose(last).position.z));
    world.step();
    ++stood;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  record.at_least("steps until the tower falls, of " + std::to_string(most), stood, most);
  record.tables.push_back(
      {"Kapla tower of 102 blocks, Δt 10 ms, 60,000 steps: steps until it falls, seconds of computing",
       {"engine", "steps", "seconds"},
       {{"Fathom (" + std::to_string(most) + " asked)", std::to_string(stood), figure(seconds)},
        {"RaiSim, 1,000 iterations", "60,000", "2,885"},
        {"RaiSim, 400 iterations", "5,265", "121"},
        {"Bullet, 1,000 iterations, error reduction", "55,058", "6,955"},
        {"Bullet, 1,000 iterations", "147", "33"},
        {"ODE, 1,000 iterations, error reduction", "6,453", "1,052"},
        {"ODE, 1,000 iterations", "122", "21"},
        {"MuJoCo (best)", "3,297", "61"},
        {"DART", "19", "6"}}});
  record.plots.push_back(std::move(plot));
}

}  // namespace fathom::validate
