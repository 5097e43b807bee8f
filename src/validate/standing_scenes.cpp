#include "validate/standing_scenes.hpp"

#include <cmath>
#include <vector>

#include "validate/bodies.hpp"
#include "validate/cut_stone.hpp"

namespace fathom::validate {
namespace {

Scene on_floor(const char* name, Material material, float floor_half_side = 100) {
  Scene scene;
  scene.name = name;
  scene.bodies.push_back(floor_slab(material, floor_half_side));
  scene.ground_height = 0;
  return scene;
}

}  // namespace

Scene large_pyramid(int rows) {
  const Material material{0.6f, 0};
  Scene scene = on_floor("large-pyramid", material, 400);
  scene.world.gravity = {0, 0, -10};
  const Shape cube = box({0.5f, 0.5f, 0.5f});
  for (int row = 0; row < rows; ++row)
    for (int i = row; i < rows; ++i)
      scene.bodies.push_back(body(
          cube, {static_cast<float>(i) - 0.5f * static_cast<float>(row + rows - 1), 0, 0.5f + static_cast<float>(row)},
          100.0f, material));
  return scene;
}

Scene running_bond_wall(int courses, int bricks, float thickness) {
  const Material material{0.6f, 0};
  Scene scene = on_floor("running-bond-wall", material);
  const float half_depth = 0.5f * thickness;
  const Shape whole = box({1, half_depth, 0.25f}), half = box({0.5f, half_depth, 0.25f});
  const float left = -static_cast<float>(bricks);
  for (int course = 0; course < courses; ++course) {
    const float z = 0.25f + 0.5f * static_cast<float>(course);
    const auto lay = [&](const Shape& brick, float x) {
      scene.bodies.push_back(body(brick, {x, 0, z}, std::nullopt, material));
    };
    const bool shifted = course % 2 != 0;
    if (shifted) lay(half, left + 0.5f);
    for (int i = 0; i < bricks - shifted; ++i)
      lay(whole, left + 2.0f * static_cast<float>(i) + (shifted ? 2.0f : 1.0f));
    if (shifted) lay(half, -left - 0.5f);
  }
  return scene;
}

Scene plates(int count) {
  Scene scene = on_floor("plates", {});
  const Shape plate = box({1, 1, 0.01f});
  for (int i = 0; i < count; ++i)
    scene.bodies.push_back(body(plate, {0, 0, 0.01f + 0.02f * static_cast<float>(i)}, std::nullopt));
  return scene;
}

Scene crossed_planks(int pairs) {
  Scene scene = on_floor("crossed-planks", {});
  const Shape along_x = box({1.5f, 0.02f, 0.02f}), along_y = box({0.02f, 1.5f, 0.02f});
  for (int pair = 0; pair < pairs; ++pair)
    for (const float off : {-1.25f, 1.25f}) {
      const float z = 0.02f + 0.04f * static_cast<float>(pair);
      const bool is_across = pair % 2 != 0;
      scene.bodies.push_back(
          body(is_across ? along_y : along_x, is_across ? Vec3{off, 0, z} : Vec3{0, off, z}, std::nullopt));
    }
  return scene;
}

Scene slab_on_cubes() {
  Scene scene = on_floor("slab-on-cubes", {});
  const Shape cube = box({0.5f, 0.5f, 0.5f});
  for (const float x : {-1.5f, 1.5f})
    for (const float y : {-1.5f, 1.5f}) scene.bodies.push_back(body(cube, {x, y, 0.5f}, 10.0f));
  scene.bodies.push_back(body(box({2, 2, 1}), {0, 0, 2}, 32000.0f));
  return scene;
}

Scene top_heavy_columns() {
  Scene scene = on_floor("top-heavy-columns", {});
  const Shape cube = box({0.5f, 0.5f, 0.5f});
  for (int column = 0; column < 3; ++column) {
    float mass = 10;
    for (int storey = 0; storey < 5; ++storey, mass *= 4)
      scene.bodies.push_back(
          body(cube, {3.0f * static_cast<float>(column), 0, 0.5f + static_cast<float>(storey)}, mass));
  }
  return scene;
}

Scene stone_arch(int stones) {
  const Material material{0.7f, 0};
  Scene scene = on_floor("stone-arch", material);
  const double inner = 4.5, outer = 5.5;
  const auto direction = [stones](int i) {
    const double angle = 3.14159265358979323846 * i / stones;
    return Vec3d{std::cos(angle), 0, std::sin(angle)};
  };
  for (int i = 0; i < stones; ++i) {
    const Vec3d from = direction(i), to = direction(i + 1), middle = 0.5 * 5.0 * (from + to);
    std::vector<Vec3d> corners;
    for (const Vec3d& side : {from, to})
      for (const double radius : {inner, outer})
        for (const double y : {-0.5, 0.5}) corners.push_back(radius * side + Vec3d{0, y, 0});
    scene.bodies.push_back(stone_of(corners, middle, material));
  }
  return scene;
}

Scene dry_stone_wall(int courses) {
  const Material material{0.7f, 0};
  Scene scene = on_floor("dry-stone-wall", material);
  Random random(2021);
  constexpr int stones = 25;
  constexpr double length = 10, pitch = length / stones;
  const auto thickness = [](double z) { return 0.9 - 0.1 * z; };  // the batter of both faces
  // A bedding plane leans by up to 0.5° along the wall and 2° across it, far below the angle of friction.
  const auto bed = [&](double z) {
    const double along = random.symmetric(0.008), across = random.symmetric(0.035);
    return Plane::through({0, 0, z}, {along, across, 1});
  };
  Plane below = Plane::through({0, 0, 0}, {0, 0, 1});
  double z = 0;
  for (int course = 0; course < courses; ++course) {
    const double height = 0.2 + random.symmetric(0.05);
    const Plane above = bed(z + height);
    const double middle = z + 0.5 * height;
    Plane left = Plane::through({-0.5 * length, 0, 0}, {1, 0, 0});
    double left_x = -0.5 * length;
    for (int i = 1; i <= stones; ++i) {
      // Joints of odd courses lie above the middles of the stones below.
      double right_x = 0.5 * length;
      Plane right = Plane::through({right_x, 0, 0}, {1, 0, 0});
      if (i < stones) {
        right_x = -0.5 * length + pitch * (i - (course % 2 ? 0.5 : 0.0)) + random.symmetric(0.05);
        const double lean_across = random.symmetric(0.15), lean_up = random.symmetric(0.15);
        right = Plane::through({right_x, 0, middle}, {1, lean_across, lean_up});
      }
      std::vector<Plane> cuts{below.opposite(), above, left.opposite(), right};
      const double face = 0.5 * thickness(middle), centre = 0.5 * (left_x + right_x);
      for (const double side : {-1.0, 1.0}) {
        // Two planes form the pointed face that a mason leaves. A third keeps it from protruding.
        cuts.push_back(Plane::through({centre, side * (face + 0.03), middle}, {0, side, 0}));
        for (int k = 0; k < 2; ++k) {
          const double turn = random.symmetric(0.3), lean = random.symmetric(0.3);
          cuts.push_back(Plane::through({centre, side * face, middle}, {turn, side, lean}));
        }
      }
      const Vec3d inside{centre, 0, middle};
      scene.bodies.push_back(stone_of(corners_of(cuts), inside, material));
      left = right;
      left_x = right_x;
    }
    below = above;
    z += height;
  }
  return scene;
}

}  // namespace fathom::validate
