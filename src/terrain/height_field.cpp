#include <algorithm>
#include <cmath>
#include <fathom/error.hpp>
#include <string>

#include "math/text.hpp"
#include "math/vec3d.hpp"
#include "terrain/height_field_builder.hpp"

namespace fathom {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw Error(ErrorCode::invalid_argument, "fathom::height_field: " + what);
}

void check(const HeightFieldDef& def) {
  const std::uint64_t samples = std::uint64_t{def.columns} * def.rows;
  const std::string size = std::to_string(def.columns) + " × " + std::to_string(def.rows);
  if (def.columns < 2 || def.rows < 2) refuse("it has " + size + " samples; at least 2 × 2 make a surface");
  if (samples > (1u << 30)) refuse("it has " + size + " samples; at most 2^30 are possible");
  if (def.heights.size() != samples)
    refuse("it has " + std::to_string(def.heights.size()) + " heights for " + size + " samples");
  const std::uint64_t cells = std::uint64_t{def.columns - 1} * (def.rows - 1);
  if (!def.holes.empty() && def.holes.size() != cells)
    refuse("its holes have " + std::to_string(def.holes.size()) + " cells; there are " + std::to_string(cells) +
           ", one less than samples along x and y");
  constexpr float farthest = 1e6f;  // m
  const auto check_cell = [&](float cell, std::uint32_t count, const char* name) {
    if (!(is_finite(cell) && cell > 0 && cell * static_cast<float>(count) <= farthest))
      refuse(std::string(name) + " is " + text(to_double(cell)) +
             " m; it must be greater than zero, and the field no longer than 1e6 m");
  };
  check_cell(def.cell_x, def.columns - 1, "cell_x");
  check_cell(def.cell_y, def.rows - 1, "cell_y");
  for (std::size_t i = 0; i < def.heights.size(); ++i)
    if (!(abs(def.heights[i]) <= farthest))
      refuse("height (" + std::to_string(i % def.columns) + ", " + std::to_string(i / def.columns) + ") is " +
             text(to_double(def.heights[i])) + " m; heights must be finite and within 1e6 m");
}

}  // namespace

std::shared_ptr<const HeightField> HeightFieldBuilder::build(const HeightFieldDef& def) {
  check(def);
  auto field = std::make_shared<HeightField>();
  field->columns_ = def.columns, field->rows_ = def.rows;
  field->cell_x_ = def.cell_x, field->cell_y_ = def.cell_y;
  field->heights_.assign(def.heights.begin(), def.heights.end());
  if (std::ranges::find(def.holes, true) != def.holes.end()) {
    field->holes_.resize((def.holes.size() + 63) / 64);
    for (std::size_t cell = 0; cell < def.holes.size(); ++cell)
      field->holes_[cell / 64] |= std::uint64_t{def.holes[cell]} << cell % 64;
  }
  field->materials_.assign(def.materials.list.begin(), def.materials.list.end());
  field->material_numbers_.assign(def.materials.numbers.begin(), def.materials.numbers.end());
  field->measure();
  return field;
}

void HeightField::measure() {
  const auto [lowest, highest] = std::ranges::minmax(heights_);
  bounds_ = {{0, 0, lowest}, sample(columns_ - 1, rows_ - 1)};
  bounds_.upper.z = highest;
}

Vec3 HeightField::sample(std::uint32_t i, std::uint32_t j) const {
  return {static_cast<float>(i) * cell_x_, static_cast<float>(j) * cell_y_, heights_[std::size_t{j} * columns_ + i]};
}

// A cell's diagonal connects its first sample to the opposite one.
Triangle HeightField::triangle(std::uint32_t triangle) const {
  const std::uint32_t cell = triangle / 2, i = cell % (columns_ - 1), j = cell / (columns_ - 1);
  const bool second = triangle % 2 != 0;
  const std::uint32_t at_i[] = {i, i + 1, second ? i : i + 1}, at_j[] = {j, second ? j + 1 : j, j + 1};
  Triangle t;
  for (int k = 0; k < 3; ++k) {
    t.corners[k] = sample(at_i[k], at_j[k]);
    t.vertices[k] = at_j[k] * columns_ + at_i[k];
  }
  return t;
}

void HeightField::find(const Aabb& box, std::vector<std::uint32_t>& found) const {
  if (!overlaps(box, bounds_)) return;
  const auto cell = [](float x, float size, std::uint32_t samples) {
    return static_cast<std::uint32_t>(clamp(x / size, 0.0f, static_cast<float>(samples - 2)));
  };
  // One more cell on each side, because the quotient is rounded.
  const auto before = [](std::uint32_t i) { return i > 0 ? i - 1 : 0; };
  const std::uint32_t i0 = before(cell(box.lower.x, cell_x_, columns_)), j0 = before(cell(box.lower.y, cell_y_, rows_));
  const std::uint32_t i1 = std::min(cell(box.upper.x, cell_x_, columns_) + 1, columns_ - 2);
  const std::uint32_t j1 = std::min(cell(box.upper.y, cell_y_, rows_) + 1, rows_ - 2);
  for (std::uint32_t j = j0; j <= j1; ++j)
    for (std::uint32_t i = i0; i <= i1; ++i) {
      const std::uint32_t number = j * (columns_ - 1) + i;
      const Vec3 a = sample(i, j), b = sample(i + 1, j + 1);
      if (a.x > box.upper.x || b.x < box.lower.x || a.y > box.upper.y || b.y < box.lower.y || is_hole(number)) continue;
      const float across[] = {heights_[std::size_t{j} * columns_ + i + 1],
                              heights_[(std::size_t{j} + 1) * columns_ + i]};
      for (std::uint32_t k = 0; k < 2; ++k) {
        const float lowest = min(a.z, min(b.z, across[k])), highest = max(a.z, max(b.z, across[k]));
        if (lowest <= box.upper.z && highest >= box.lower.z) found.push_back(2 * number + k);
      }
    }
}

std::size_t HeightField::memory_bytes() const {
  return heights_.capacity() * sizeof(float) + holes_.capacity() * sizeof(std::uint64_t) + materials().size_bytes() +
         material_numbers().size_bytes();
}

}  // namespace fathom
