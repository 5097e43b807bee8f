#include "scene/scene_surfaces.hpp"

#include <algorithm>
#include <cmath>
#include <fathom/mesh.hpp>
#include <fathom/saved_shape.hpp>
#include <filesystem>
#include <memory>
#include <span>

#include "files/input_file.hpp"
#include "scene/gltf_file.hpp"
#include "scene/made_ground.hpp"
#include "scene/obj_file.hpp"
#include "scene/pgm_file.hpp"

namespace fathom {
namespace {

constexpr int max_samples_a_side = 1 << 20;
constexpr std::uint64_t max_samples = std::uint64_t{1} << 26;

/// The only one of the keys in the table.
std::string_view only_one_of(const TomlTable& table, std::initializer_list<std::string_view> keys,
                             const std::string& remedy) {
  std::string_view found;
  for (const std::string_view key : keys) {
    if (!table.has(key)) continue;
    if (!found.empty())
      table.fail(*table.find(key), table.name() + " has both '" + std::string(found) + "' and '" + std::string(key) +
                                       "'; remove one of them");
    found = key;
  }
  if (found.empty()) table.fail(table.name() + " needs " + remedy);
  return found;
}

/// Refuses keys that do not go with `source`, which would silently have no effect.
void refuse_with(const TomlTable& table, std::string_view source, std::initializer_list<std::string_view> keys) {
  for (const std::string_view key : keys)
    if (const toml::node* node = table.find(key))
      table.fail(*node,
                 "'" + std::string(key) + "' does not go with '" + std::string(source) + "'; remove one of them");
}

struct SurfaceFile {
  std::string path, content;
};

SurfaceFile read_file(const TomlTable& table, const std::string& kind) {
  std::string name;
  table.read("file", name);
  const toml::node& node = *table.find("file");
  const std::filesystem::path path = std::filesystem::path(table.file()).parent_path() / name;
  const std::string remedy = "; give the path of " + kind + " from the scene file's folder";
  std::error_code ignored;
  if (!name.empty() && std::filesystem::is_directory(path, ignored))
    table.fail(node, path.string() + " is a folder" + remedy);
  if (name.empty() || !std::filesystem::is_regular_file(path, ignored))
    table.fail(node, "there is no file " + (name.empty() ? "named ''" : path.string()) + remedy);
  try {
    return {path.string(), files::read_file(path.string(), "check its permissions")};
  } catch (const Error& error) {
    table.fail(node, error.what());
  }
}

/// Non-negative integers, each below a limit; `what` names them in error messages.
std::vector<std::uint32_t> read_indices(const TomlTable& table, const toml::node& node, std::string_view key,
                                        std::initializer_list<std::size_t> limits, std::string_view what) {
  const std::vector<float> numbers = table.numbers(node, key, limits.size(), limits.size());
  std::vector<std::uint32_t> indices;
  for (const std::size_t limit : limits) {
    const double value = static_cast<double>(numbers[indices.size()]);
    if (!(value >= 0) || value != std::floor(value) || value >= static_cast<double>(limit))
      table.fail(node, "there is no such " + std::string(what) + " in '" + std::string(key) + "': they go from 0 to " +
                           std::to_string(limit - 1));
    indices.push_back(static_cast<std::uint32_t>(value));
  }
  return indices;
}

FileTriangles read_triangles(const TomlTable& table) {
  const std::string remedy =
      "lists [x, y, z] of 'vertices' (m) and [0, 1, 2] of 'triangles', or a 'file' (*.obj, *.gltf, *.glb)";
  FileTriangles read;
  for (const toml::node& vertex : table.as_array(table.required("vertices", remedy), "vertices")) {
    const std::vector<float> v = table.numbers(vertex, "vertices", 3, 3);
    read.vertices.push_back({v[0], v[1], v[2]});
  }
  const std::size_t count = read.vertices.size();
  const toml::node& triangles = table.required("triangles", remedy);
  if (count == 0) table.fail(triangles, "there are no 'vertices' for the triangles; list them");
  if (count >= (1 << 24))
    table.fail("there are too many 'vertices' to list, " + std::to_string(count) + "; use a 'file'");
  for (const toml::node& triangle : table.as_array(triangles, "triangles")) {
    const auto corners = read_indices(table, triangle, "triangles", {count, count, count}, "vertex");
    read.indices.insert(read.indices.end(), corners.begin(), corners.end());
  }
  return read;
}

/// One factor, or one per axis.
Vec3 read_scale(const TomlTable& table) {
  Vec3 scale{1, 1, 1};
  const toml::node* node = table.find("scale");
  if (node && node->is_number()) {
    table.read("scale", scale.x, Range::positive);
    return {scale.x, scale.x, scale.x};
  }
  table.read("scale", scale, Range::positive);
  return scale;
}

/// Heights (m) and their number along x and y.
struct Heights {
  int columns = 0, rows = 0;
  std::vector<float> values;
};

/// Width of a cell along x and y.
std::pair<float, float> read_cell(const TomlTable& table) {
  const toml::node& node = table.required("cell", "m between heights, one number, or [x, y]");
  float width = 0;
  if (node.is_number()) {
    table.read("cell", width, Range::positive);
    return {width, width};
  }
  const std::vector<float> both = table.numbers(node, "cell", 2, 2);
  if (!(std::min(both[0], both[1]) > 0)) table.fail(node, "'cell' must be greater than 0");
  return {both[0], both[1]};
}

Heights read_size(const TomlTable& table) {
  Heights heights;
  table.required("columns", "how many heights there are along x");
  table.required("rows", "how many heights there are along y");
  table.read("columns", heights.columns, 2, max_samples_a_side);
  table.read("rows", heights.rows, 2, max_samples_a_side);
  const auto samples = static_cast<std::uint64_t>(heights.columns) * static_cast<std::uint64_t>(heights.rows);
  if (samples > max_samples)
    table.fail("'columns' × 'rows' are " + std::to_string(samples) + " heights; at most " +
               std::to_string(max_samples) + " are possible");
  return heights;
}

Heights listed(const TomlTable& table) {
  Heights heights = read_size(table);
  const auto samples = static_cast<std::size_t>(heights.columns) * static_cast<std::size_t>(heights.rows);
  heights.values = table.numbers(*table.find("heights"), "heights", samples, samples);
  return heights;
}

/// The image's upper edge is the far one: seen from above, y up, the ground looks like the image.
Heights pictured(const TomlTable& table) {
  refuse_with(table, "file", {"columns", "rows"});
  float scale = 0, offset = 0;
  table.required("scale", "height of white above black (m)");
  table.read("scale", scale, Range::positive);
  table.read("offset", offset);
  const SurfaceFile file = read_file(table, "a grey picture (*.pgm)");
  const GreyPicture picture = parse_pgm(file.content, file.path, max_samples);
  Heights heights{static_cast<int>(picture.width), static_cast<int>(picture.height), {}};
  for (std::size_t row = picture.height; row-- > 0;)
    for (std::size_t column = 0; column < picture.width; ++column)
      heights.values.push_back(offset + scale * picture.pixels[row * picture.width + column]);
  return heights;
}

/// Reads the keys common to waves and hills.
template <class Ground>
void read_ground(const TomlTable& table, float cell, Ground& ground) {
  float height = 0, length = 0;
  table.required("height", "from the lowest to the highest that there may be (m)");
  table.required("length", "width of the largest (m)");
  table.read("height", height, Range::positive);
  table.read("length", length, Range::positive);
  table.read("seed", ground.seed);
  if (length < 2 * cell)
    table.fail(*table.find("length"), "'length' must be at least two cells, or the ground cannot show it");
  ground.height = static_cast<double>(height);
  ground.length = static_cast<double>(length);
}

Waves read_waves(const TomlTable& outer, float cell) {
  const TomlTable table(outer.as_table(*outer.find("waves"), "waves"), "waves", outer.file(),
                        {"height", "length", "seed"});
  Waves waves;
  read_ground(table, cell, waves);
  return waves;
}

Hills read_hills(const TomlTable& outer, float cell) {
  const TomlTable table(outer.as_table(*outer.find("hills"), "hills"), "hills", outer.file(),
                        {"height", "length", "roughness", "seed"});
  Hills hills;
  read_ground(table, cell, hills);
  float roughness = 0.5f;
  table.read("roughness", roughness, Range::unit_interval);
  hills.roughness = static_cast<double>(roughness);
  // No hill is narrower than two cells.
  hills.layers = std::clamp(1 + static_cast<int>(std::log2(hills.length / (2 * static_cast<double>(cell)))), 1, 8);
  return hills;
}

template <class Ground>
Heights made(const TomlTable& table, std::pair<float, float> cell, const Ground& ground) {
  Heights heights = read_size(table);
  for (int j = 0; j < heights.rows; ++j)
    for (int i = 0; i < heights.columns; ++i)
      heights.values.push_back(
          static_cast<float>(ground.at(i * static_cast<double>(cell.first), j * static_cast<double>(cell.second))));
  return heights;
}

std::vector<Material> without_names(const std::vector<NamedMaterial>& named) {
  std::vector<Material> materials;
  for (const NamedMaterial& one : named) materials.push_back(one.material);
  return materials;
}

/// Number of a material; `node` is an entry of the list `key`.
std::uint8_t material_number(const TomlTable& table, const toml::node& node, std::string_view key, float number,
                             std::size_t materials) {
  const double value = static_cast<double>(number);
  if (!(value >= 0) || value != std::floor(value) || value >= static_cast<double>(materials))
    table.fail(node, "there is no such material in '" + std::string(key) + "': 'materials' has " +
                         std::to_string(materials) + ", counted from 0");
  return static_cast<std::uint8_t>(value);
}

/// Of a mesh that is listed here: one number per triangle.
std::vector<std::uint8_t> listed_numbers(const TomlTable& table, std::size_t triangles, std::size_t materials) {
  const toml::node& node = table.required("triangle_materials", "for each triangle the number of one of 'materials'");
  std::vector<std::uint8_t> numbers;
  for (const float number : table.numbers(node, "triangle_materials", triangles, triangles))
    numbers.push_back(material_number(table, node, "triangle_materials", number, materials));
  return numbers;
}

/// Of a mesh from a file: the material with the name that the file gives, or the first one.
std::vector<std::uint8_t> numbers_by_name(const FileTriangles& mesh, const std::vector<NamedMaterial>& materials) {
  std::vector<std::uint8_t> number_of;
  for (const std::string& name : mesh.materials) {
    const auto found = std::ranges::find(materials, name, &NamedMaterial::name);
    number_of.push_back(found == materials.end() || name.empty()
                            ? std::uint8_t{0}
                            : static_cast<std::uint8_t>(found - materials.begin()));
  }
  std::vector<std::uint8_t> numbers;
  for (const std::uint32_t material : mesh.material_of) numbers.push_back(number_of[material]);
  return numbers;
}

/// Of a field: [i, j, number] for a cell, [i, j, k, l, number] for those from (i, j) to (k, l); others have 0.
std::vector<std::uint8_t> cell_numbers(const TomlTable& table, std::size_t across, std::size_t along,
                                       std::size_t materials) {
  constexpr std::string_view key = "cell_materials";
  std::vector<std::uint8_t> numbers(across * along);
  const toml::node& node = table.required(key, "arrays [i, j, number] of cells and numbers of 'materials'");
  for (const toml::node& entry : table.as_array(node, key)) {
    const std::size_t length = table.as_array(entry, key).size();
    if (length != 3 && length != 5)
      table.fail(entry,
                 "'cell_materials' has arrays [i, j, number] for a cell, or [i, j, k, l, number] for those "
                 "from (i, j) to (k, l)");
    const std::vector<float> all = table.numbers(entry, key, length, length);
    const auto cell = [&](std::size_t at, std::size_t limit) {
      const double value = static_cast<double>(all[at]);
      if (!(value >= 0) || value != std::floor(value) || value >= static_cast<double>(limit))
        table.fail(entry, "there is no such cell in 'cell_materials': they go from 0 to " + std::to_string(limit - 1));
      return static_cast<std::size_t>(value);
    };
    const std::size_t i0 = cell(0, across), j0 = cell(1, along);
    const std::size_t i1 = length == 5 ? cell(2, across) : i0, j1 = length == 5 ? cell(3, along) : j0;
    const std::uint8_t number = material_number(table, entry, key, all.back(), materials);
    for (std::size_t j = j0; j <= j1; ++j)
      for (std::size_t i = i0; i <= i1; ++i) numbers[j * across + i] = number;
  }
  return numbers;
}

/// The list and the numbers go together.
void require_materials_for(const TomlTable& table, std::string_view numbers,
                           const std::vector<NamedMaterial>& materials) {
  if (const toml::node* node = table.find(numbers); node && materials.empty())
    table.fail(*node, "'" + std::string(numbers) + "' needs a list of 'materials'");
}

}  // namespace

Shape read_mesh(const TomlTable& outer, const toml::table& shape, const std::string& name,
                const ReadMaterials& read_materials) {
  const TomlTable table(shape, name, outer.file(),
                        {"type", "file", "scale", "vertices", "triangles", "materials", "triangle_materials"});
  FileTriangles read;
  const std::vector<NamedMaterial> materials = read_materials(table);
  if (table.has("file")) {
    refuse_with(table, "file", {"vertices", "triangles", "triangle_materials"});
    const SurfaceFile file = read_file(table, "a mesh (*.obj, *.gltf, *.glb)");
    const std::string ending = std::filesystem::path(file.path).extension().string();
    const bool is_gltf = ending == ".gltf" || ending == ".glb";
    read = is_gltf ? parse_gltf(file.content, file.path) : parse_obj(file.content, file.path);
  } else {
    read = read_triangles(table);
  }
  const Vec3 scale = read_scale(table);
  for (Vec3& vertex : read.vertices) vertex = {scale.x * vertex.x, scale.y * vertex.y, scale.z * vertex.z};
  require_materials_for(table, "triangle_materials", materials);
  std::vector<std::uint8_t> numbers;
  if (!materials.empty())
    numbers = table.has("file") ? numbers_by_name(read, materials)
                                : listed_numbers(table, read.indices.size() / 3, materials.size());
  return mesh(read.vertices, read.indices, {without_names(materials), numbers});
}

Shape read_saved_shape(const TomlTable& outer, const toml::table& shape, const std::string& name) {
  const TomlTable table(shape, name, outer.file(), {"type", "file"});
  const toml::node& node = table.required("file", "the path of a shape that 'fathom save-shape' wrote");
  const SurfaceFile file = read_file(table, "a shape that 'fathom save-shape' wrote");
  try {
    return load_shape(std::as_bytes(std::span(file.content)));
  } catch (const Error& error) {
    table.fail(node, file.path + ": " + error.what());
  }
}

Shape read_height_field(const TomlTable& outer, const toml::table& shape, const std::string& name,
                        const ReadMaterials& read_materials) {
  const TomlTable table(shape, name, outer.file(),
                        {"type", "columns", "rows", "cell", "heights", "file", "scale", "offset", "waves", "hills",
                         "holes", "materials", "cell_materials"});
  const std::string_view source =
      only_one_of(table, {"heights", "file", "waves", "hills"},
                  "one of 'heights' (a list, m), 'file' (*.pgm), 'waves' and 'hills': where its heights come from");
  if (source != "file") refuse_with(table, source, {"scale", "offset"});
  const auto cell = read_cell(table);
  const float widest = std::max(cell.first, cell.second);
  const Heights heights = source == "heights" ? listed(table)
                          : source == "file"  ? pictured(table)
                          : source == "waves" ? made(table, cell, read_waves(table, widest))
                                              : made(table, cell, read_hills(table, widest));
  HeightFieldDef def{static_cast<std::uint32_t>(heights.columns), static_cast<std::uint32_t>(heights.rows), cell.first,
                     cell.second, heights.values};
  std::unique_ptr<bool[]> holes;
  if (const toml::node* node = table.find("holes"); node && heights.columns >= 2 && heights.rows >= 2) {
    const std::size_t across = def.columns - 1, along = def.rows - 1;
    holes = std::make_unique<bool[]>(across * along);
    for (const toml::node& hole : table.as_array(*node, "holes")) {
      const auto at = read_indices(table, hole, "holes", {across, along}, "cell");
      holes[at[1] * across + at[0]] = true;
    }
    def.holes = {holes.get(), across * along};
  }
  const std::vector<NamedMaterial> named = read_materials(table);
  require_materials_for(table, "cell_materials", named);
  const std::vector<Material> materials = without_names(named);
  std::vector<std::uint8_t> numbers;
  if (!materials.empty() && heights.columns >= 2 && heights.rows >= 2)
    numbers = cell_numbers(table, def.columns - 1, def.rows - 1, materials.size());
  def.materials = {materials, numbers};
  return height_field(def);
}

}  // namespace fathom
