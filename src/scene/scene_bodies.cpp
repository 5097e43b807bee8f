#include "scene/scene_bodies.hpp"

#include <array>
#include <cmath>
#include <fathom/compound.hpp>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "scene/scene_surfaces.hpp"
#include "scene/suggest.hpp"

namespace fathom {
namespace {

template <class T>
using Choice = std::pair<std::string_view, T>;

constexpr std::array<Choice<CombineRule>, 5> combine_rules{{{"average", CombineRule::average},
                                                            {"minimum", CombineRule::minimum},
                                                            {"geometric_mean", CombineRule::geometric_mean},
                                                            {"multiply", CombineRule::multiply},
                                                            {"maximum", CombineRule::maximum}}};
constexpr std::array<Choice<MotionType>, 4> motions{{{"static", MotionType::fixed},
                                                     {"fixed", MotionType::fixed},
                                                     {"kinematic", MotionType::kinematic},
                                                     {"dynamic", MotionType::dynamic}}};

/// A shape's type in a file. Cylinders and cones are hulls.
enum class ShapeKind : std::uint8_t { sphere, capsule, box, hull, cylinder, cone, mesh, height_field, compound, saved };
constexpr std::array<Choice<ShapeKind>, 10> shape_kinds{{{"sphere", ShapeKind::sphere},
                                                         {"capsule", ShapeKind::capsule},
                                                         {"box", ShapeKind::box},
                                                         {"hull", ShapeKind::hull},
                                                         {"cylinder", ShapeKind::cylinder},
                                                         {"cone", ShapeKind::cone},
                                                         {"mesh", ShapeKind::mesh},
                                                         {"height_field", ShapeKind::height_field},
                                                         {"compound", ShapeKind::compound},
                                                         {"saved", ShapeKind::saved}}};

template <class T>
using Named = std::map<std::string, T, std::less<>>;

Material read_material(const TomlTable& outer, const toml::node& node, const std::string& name) {
  const TomlTable table(outer.as_table(node, name), name, outer.file(),
                        {"friction", "restitution", "friction_rule", "restitution_rule", "rolling_resistance",
                         "surface_velocity", "friction_axis", "friction_along"});
  Material material;
  table.read("friction", material.friction, Range::not_negative);
  table.read("restitution", material.restitution, Range::unit_interval);
  table.read("rolling_resistance", material.rolling_resistance, Range::not_negative);
  table.read("surface_velocity", material.surface_velocity);
  table.read("friction_axis", material.friction_axis);
  table.read("friction_along", material.friction_along, Range::not_negative);
  table.read_choice<CombineRule>("friction_rule", material.friction_rule, combine_rules);
  table.read_choice<CombineRule>("restitution_rule", material.restitution_rule, combine_rules);
  return material;
}

/// Other engines' names of shapes that do not exist here, and what to use instead.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> absent_shapes{
    {{"trimesh", "\"mesh\" for what is static or kinematic, else a \"compound\" of hulls"},
     {"heightfield", "\"height_field\""},
     {"terrain", "\"height_field\" or \"mesh\""},
     {"plane", "a static body with a large \"box\""}}};

/// Reads only the type, which determines the other keys.
ShapeKind read_shape_kind(const TomlTable& outer, const toml::table& shape, const std::string& name) {
  const TomlTable table(shape, name, outer.file());
  ShapeKind kind = ShapeKind::box;
  const toml::node& node = table.required("type",
                                          "write type = \"sphere\", \"capsule\", \"box\", \"hull\", \"cylinder\", "
                                          "\"cone\", \"compound\", \"mesh\" or \"height_field\"");
  for (const auto& [absent, instead] : absent_shapes)
    if (node.value<std::string_view>() == absent)
      table.fail(node, "there is no shape of type '" + std::string(absent) + "'; take " + std::string(instead));
  table.read_choice<ShapeKind>("type", kind, shape_kinds);
  return kind;
}

Shape read_sphere(const TomlTable& table) {
  float radius = 0;
  table.required("radius", "its radius (m)");
  table.read("radius", radius, Range::positive);
  return sphere(radius);
}

Shape read_capsule(const TomlTable& table) {
  float radius = 0;
  float half_length = 0;
  table.required("radius", "its radius (m)");
  table.required("half_length", "half the length of its segment along z (m)");
  table.read("radius", radius, Range::positive);
  table.read("half_length", half_length, Range::not_negative);
  return capsule(radius, half_length);
}

Shape read_box(const TomlTable& table) {
  Vec3 half_extents;
  table.required("half_extents", "half its edges along x, y and z (m)");
  table.read("half_extents", half_extents, Range::positive);
  return box(half_extents);
}

Shape read_hull(const TomlTable& table) {
  const toml::node& node = table.required("points", "at least 4 points [x, y, z] (m) that span a volume");
  std::vector<Vec3> points;
  for (const toml::node& point : table.as_array(node, "points")) {
    const std::vector<float> v = table.numbers(point, "points", 3, 3);
    points.push_back({v[0], v[1], v[2]});
  }
  return hull(points);
}

int read_sides(const TomlTable& table) {
  int sides = 32;
  table.read("sides", sides, 3, 127);
  return sides;
}

Shape read_cylinder(const TomlTable& table) {
  float radius = 0, half_height = 0;
  table.required("radius", "its radius (m)");
  table.required("half_height", "half its height along z (m)");
  table.read("radius", radius, Range::positive);
  table.read("half_height", half_height, Range::positive);
  return cylinder(radius, half_height, read_sides(table));
}

Shape read_cone(const TomlTable& table) {
  float radius = 0, height = 0, top_radius = 0;
  table.required("radius", "the radius of its base (m)");
  table.required("height", "its height along z (m)");
  table.read("radius", radius, Range::positive);
  table.read("height", height, Range::positive);
  table.read("top_radius", top_radius, Range::not_negative);
  return cone(radius, height, top_radius, read_sides(table));
}

/// A shape with edges, read by `read`, and everything within its `rounding`.
Shape read_rounded(const TomlTable& table, Shape (*read)(const TomlTable&)) {
  float rounding = 0;
  table.read("rounding", rounding, Range::not_negative);
  return rounded(read(table), rounding);
}

Filter read_filter(const TomlTable& outer, const toml::node& node) {
  const TomlTable table(outer.as_table(node, "filter"), "filter", outer.file(), {"category", "mask", "group"});
  Filter filter;
  table.read_bits("category", filter.category);
  table.read_bits("mask", filter.mask);
  table.read("group", filter.group, std::numeric_limits<int>::min());
  return filter;
}

/// What the entry `at` of the table refers to by its `name` in the section [keys] of the file, e.g. [shapes.wheel] for
/// the key "shape" and the name "wheel".
std::pair<const toml::node*, std::string> node_named(const TomlTable& root, const TomlTable& table,
                                                     const toml::node& at, std::string_view key,
                                                     const std::string& name) {
  const std::string section = std::string(key) + "s";
  std::vector<std::string_view> known;
  if (const toml::node* node = root.find(section))
    for (const auto& [other, value] : root.as_table(*node, section)) {
      if (other.str() == name) return {&value, "[" + section + "." + name + "]"};
      known.push_back(other.str());
    }
  table.fail(at, "there is no [" + section + "." + name + "]" +
                     (known.empty() ? "; write one, or the " + std::string(key) + " itself as a table"
                                    : suggestion(name, known)));
}

/// The same for the value of `key`.
std::pair<const toml::node*, std::string> look_up_node(const TomlTable& root, const TomlTable& table,
                                                       std::string_view key) {
  std::string name;
  table.read(key, name);
  return node_named(root, table, *table.find(key), key, name);
}

Shape read_shape(const TomlTable& root, const TomlTable& outer, const toml::node& node, const std::string& name);

Shape read_child_shape(const TomlTable& root, const TomlTable& child) {
  const toml::node& given = child.required("shape", "the name of one of [shapes], or a table");
  const auto [node, name] =
      given.is_table() ? std::pair(&given, std::string("shape")) : look_up_node(root, child, "shape");
  if (const toml::table* table = node->as_table(); table && (*table)["type"].value<std::string_view>() == "compound")
    child.fail(given, "a child is one convex shape, not a compound; give its children here");
  return read_shape(root, child, *node, name);
}

Shape read_compound(const TomlTable& root, const toml::table& shape, const std::string& name) {
  const TomlTable table(shape, name, root.file(), {"type", "children"});
  const toml::node& node = table.required("children", "a list of tables, each with a shape and a position (m)");
  std::vector<ChildShape> children;
  for (const toml::node& entry : table.as_array(node, "children")) {
    const std::string number = "child " + std::to_string(children.size());
    const TomlTable child(table.as_table(entry, number), number, root.file(),
                          {"shape", "position", "rotation", "density", "material", "filter", "user_data"});
    ChildShape& c = children.emplace_back();
    c.shape = read_child_shape(root, child);
    child.read("position", c.pose.position);
    child.read("rotation", c.pose.rotation);
    child.read("density", c.density, Range::positive);
    child.read("user_data", c.user_data);
    if (const toml::node* filter = child.find("filter")) c.filter = read_filter(child, *filter);
    if (const toml::node* material = child.find("material")) {
      const auto [named, full_name] =
          material->is_table() ? std::pair(material, std::string("material")) : look_up_node(root, child, "material");
      c.material = read_material(child, *named, full_name);
    }
  }
  return compound(children);
}

/// The list `materials` of a surface: names of [materials], or tables.
std::vector<NamedMaterial> read_materials_of(const TomlTable& root, const TomlTable& shape) {
  std::vector<NamedMaterial> materials;
  const toml::node* const list = shape.find("materials");
  if (!list) return materials;
  for (const toml::node& entry : shape.as_array(*list, "materials")) {
    if (entry.is_table()) {
      materials.push_back({"", read_material(shape, entry, "material " + std::to_string(materials.size()))});
      continue;
    }
    const auto name = entry.value<std::string>();
    if (!name) shape.fail(entry, "'materials' is a list of tables and names of [materials]");
    const auto [node, full_name] = node_named(root, shape, entry, "material", *name);
    materials.push_back({*name, read_material(shape, *node, full_name)});
  }
  if (materials.empty()) shape.fail(*list, "'materials' is empty; list some, or leave it out");
  return materials;
}

Shape read_shape_of_kind(const TomlTable& root, const TomlTable& outer, const toml::table& shape, ShapeKind kind,
                         const std::string& name) {
  const std::string_view file = outer.file();
  const auto materials = [&root](const TomlTable& surface) { return read_materials_of(root, surface); };
  switch (kind) {
    case ShapeKind::sphere:
      return read_sphere({shape, name, file, {"type", "radius"}});
    case ShapeKind::capsule:
      return read_capsule({shape, name, file, {"type", "radius", "half_length"}});
    case ShapeKind::box:
      return read_rounded({shape, name, file, {"type", "half_extents", "rounding"}}, read_box);
    case ShapeKind::cylinder:
      return read_rounded({shape, name, file, {"type", "radius", "half_height", "sides", "rounding"}}, read_cylinder);
    case ShapeKind::cone:
      return read_rounded({shape, name, file, {"type", "radius", "height", "top_radius", "sides", "rounding"}},
                          read_cone);
    case ShapeKind::mesh:
      return read_mesh(outer, shape, name, materials);
    case ShapeKind::height_field:
      return read_height_field(outer, shape, name, materials);
    case ShapeKind::compound:
      return read_compound(root, shape, name);
    case ShapeKind::saved:
      return read_saved_shape(outer, shape, name);
    case ShapeKind::hull:
      break;
  }
  return read_rounded({shape, name, file, {"type", "points", "rounding"}}, read_hull);
}

Shape read_shape(const TomlTable& root, const TomlTable& outer, const toml::node& node, const std::string& name) {
  const toml::table& shape = outer.as_table(node, name);
  const ShapeKind kind = read_shape_kind(outer, shape, name);
  try {
    return read_shape_of_kind(root, outer, shape, kind, name);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::file) throw;  // names the position already
    outer.fail(node, name + ": " + error.what());
  }
}

/// Reads one kind of named objects, e.g. all tables of [shapes].
template <class T, class Read>
Named<T> read_named(const TomlTable& root, std::string_view section, Read read) {
  Named<T> things;
  const toml::node* node = root.find(section);
  if (!node) return things;
  for (const auto& [key, value] : root.as_table(*node, section)) {
    const std::string name = "[" + std::string(section) + "." + std::string(key.str()) + "]";
    things.emplace(key.str(), read(value, name));
  }
  return things;
}

template <class T>
const T& look_up(const TomlTable& body, std::string_view key, const Named<T>& things) {
  std::string name;
  body.read(key, name);
  const auto found = things.find(name);
  if (found != things.end()) return found->second;
  std::vector<std::string_view> known;
  for (const auto& thing : things) known.push_back(thing.first);
  const std::string section = "[" + std::string(key) + "s." + name + "]";
  body.fail(*body.find(key), "there is no " + section +
                                 (known.empty() ? "; write one, or the " + std::string(key) + " itself as a table"
                                                : suggestion(name, known)));
}

/// Sylvester's criterion.
bool is_positive_definite(const SymMat3& m) {
  const float minor = m.xx * m.yy - m.xy * m.xy;
  const float determinant = dot(to_matrix(m).x, cross(to_matrix(m).y, to_matrix(m).z));
  return m.xx > 0 && minor > 0 && determinant > 0;
}

/// Reads [[body]] tables in order.
class BodyReader {
 public:
  BodyReader(const TomlTable& root, Scene& scene)
      : root_(root),
        scene_(scene),
        materials_(read_named<Material>(
            root, "materials",
            [&](const toml::node& node, const std::string& name) { return read_material(root, node, name); })),
        shapes_(read_named<Shape>(root, "shapes", [&](const toml::node& node, const std::string& name) {
          return read_shape(root, root, node, name);
        })) {}

  void read(const toml::table& node) {
    const TomlTable table(node, "[[body]]", root_.file(),
                          {"name",           "motion",           "shape",     "material", "position", "rotation",
                           "velocity",       "angular_velocity", "mass",      "density",  "inertia",  "gravity_scale",
                           "linear_damping", "angular_damping",  "can_sleep", "sensor",   "bullet",   "pre_solve",
                           "custom_filter",  "filter",           "user_data", "repeat"});
    BodyDef body;
    read_shape_of(table, body);
    read_placement(table, body);
    read_mass(table, body);
    read_behaviour(table, body);
    try_out(table, body);
    add(table, body);
  }

 private:
  struct Repeat {
    std::array<int, 3> count{1, 1, 1};
    Vec3 spacing{1, 1, 1};
  };

  void read_shape_of(const TomlTable& table, BodyDef& body) const {
    const toml::node& node = table.required("shape", "the name of one of [shapes], or a table");
    body.shape = node.is_table() ? read_shape(root_, table, node, "shape") : look_up(table, "shape", shapes_);
    if (const toml::node* material = table.find("material")) {
      body.material =
          material->is_table() ? read_material(table, *material, "material") : look_up(table, "material", materials_);
    }
  }

  static void read_placement(const TomlTable& table, BodyDef& body) {
    table.read_choice<MotionType>("motion", body.motion, motions);
    table.read("position", body.pose.position);
    table.read("rotation", body.pose.rotation);
    table.read("velocity", body.velocity.linear);
    table.read("angular_velocity", body.velocity.angular);
    if (body.motion != MotionType::fixed) return;
    for (const auto& [key, value] :
         {std::pair("velocity", body.velocity.linear), {"angular_velocity", body.velocity.angular}})
      if (value != Vec3{})
        table.fail(*table.find(key),
                   "a static body has no '" + std::string(key) + "'; remove it, or write motion = \"kinematic\"");
  }

  /// Bodies that nothing can push have none of these: they would only seem to matter.
  static void refuse_mass(const TomlTable& table, MotionType motion) {
    if (motion == MotionType::dynamic) return;
    const std::string name = motion == MotionType::kinematic ? "kinematic" : "static";
    for (const char* key : {"mass", "density", "inertia"})
      if (const toml::node* node = table.find(key))
        table.fail(*node, "a " + name + " body has no '" + key + "'; remove it, or write motion = \"dynamic\"");
  }

  static void read_mass(const TomlTable& table, BodyDef& body) {
    refuse_mass(table, body.motion);
    if (table.has("mass") && table.has("density")) {
      table.fail(*table.find("density"), "a body has either 'mass' or 'density'; remove one");
    }
    table.read("mass", body.mass, Range::positive);
    table.read("density", body.density, Range::positive);
    if (const toml::node* node = table.find("inertia")) body.inertia = read_inertia(table, *node);
  }

  static SymMat3 read_inertia(const TomlTable& table, const toml::node& node) {
    std::vector<float> v = table.numbers(node, "inertia", 3, 6);
    if (v.size() != 3 && v.size() != 6) {
      table.fail(node, "'inertia' must be [xx, yy, zz] or [xx, yy, zz, xy, xz, yz] (kg·m²)");
    }
    v.resize(6, 0.0f);
    const SymMat3 inertia{v[0], v[1], v[2], v[3], v[4], v[5]};
    if (!is_positive_definite(inertia)) {
      table.fail(node, "'inertia' must be positive definite; the diagonal must outweigh the products");
    }
    return inertia;
  }

  /// Reports what a world would refuse, with its position in the file.
  void try_out(const TomlTable& table, const BodyDef& body) {
    try {
      trial_.remove(trial_.add(body));
    } catch (const Error& error) {
      const toml::node* inertia = table.find("inertia");
      const bool of_inertia = inertia && std::string_view(error.what()).find("inertia") != std::string_view::npos;
      std::string text = error.what();
      if (constexpr std::string_view action = "add body: "; text.starts_with(action)) text.erase(0, action.size());
      of_inertia ? table.fail(*inertia, text) : table.fail(text);
    }
  }

  static void read_behaviour(const TomlTable& table, BodyDef& body) {
    table.read("gravity_scale", body.gravity_scale);
    table.read("linear_damping", body.linear_damping, Range::not_negative);
    table.read("angular_damping", body.angular_damping, Range::not_negative);
    table.read("can_sleep", body.can_sleep);
    table.read("sensor", body.sensor);
    table.read("bullet", body.bullet);
    refuse_bullet(table, body);
    table.read("pre_solve", body.pre_solve);
    table.read("custom_filter", body.custom_filter);
    table.read("user_data", body.user_data);
    if (const toml::node* node = table.find("filter")) body.filter = read_filter(table, *node);
  }

  /// All bodies are swept against those that nothing can push, and these against no others.
  static void refuse_bullet(const TomlTable& table, const BodyDef& body) {
    if (!body.bullet || body.motion == MotionType::dynamic) return;
    const std::string name = body.motion == MotionType::kinematic ? "kinematic" : "static";
    table.fail(*table.find("bullet"),
               "a " + name + " body cannot be a 'bullet'; remove it, or write motion = \"dynamic\"");
  }

  static Repeat read_repeat(const TomlTable& body) {
    Repeat repeat;
    const toml::node* node = body.find("repeat");
    if (!node) return repeat;
    const TomlTable table(body.as_table(*node, "repeat"), "repeat", body.file(), {"count", "spacing"});
    const std::string_view remedy = "write repeat = {count = [4, 4, 1], spacing = [1.1, 1.1, 1.1]}";
    const toml::node& count = table.required("count", remedy);
    table.required("spacing", remedy);
    table.read("spacing", repeat.spacing);
    const std::vector<float> v = table.numbers(count, "count", 3, 3);
    for (std::size_t i = 0; i < 3; ++i) {
      if (!(v[i] >= 1) || v[i] > 1e8f || v[i] != std::floor(v[i])) {
        table.fail(count, "every component of 'count' must be a whole number from 1");
      }
      repeat.count[i] = static_cast<int>(v[i]);
    }
    return repeat;
  }

  void add(const TomlTable& table, BodyDef body) {
    const Repeat repeat = read_repeat(table);
    const auto [nx, ny, nz] = repeat.count;
    const double total = static_cast<double>(nx) * ny * nz;
    if (total + static_cast<double>(scene_.bodies.size()) > static_cast<double>(scene_.world.max_bodies)) {
      table.fail("the world holds at most " + std::to_string(scene_.world.max_bodies) + " bodies; repeat fewer");
    }
    const std::string name = read_name(table);
    const Vec3 first = body.pose.position;
    for (int z = 0; z < nz; ++z) {
      for (int y = 0; y < ny; ++y) {
        for (int x = 0; x < nx; ++x) {
          const Vec3 at{static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
          body.pose.position = first + Vec3{at.x * repeat.spacing.x, at.y * repeat.spacing.y, at.z * repeat.spacing.z};
          name_next(table, name, total > 1);
          scene_.bodies.push_back(body);
        }
      }
    }
  }

  std::string read_name(const TomlTable& table) {
    std::string name;
    table.read("name", name);
    if (!name.empty()) take_name(table, name);
    return name;
  }

  void take_name(const TomlTable& table, const std::string& name) {
    if (!taken_.insert(name).second)
      table.fail(*table.find("name"), "another body is named '" + name + "'; names are unique");
  }

  /// Repeated bodies are numbered: crate.0, crate.1, …
  void name_next(const TomlTable& table, const std::string& name, bool repeated) {
    if (name.empty()) return;
    numbered_ = repeated && last_name_ == name ? numbered_ + 1 : 0;
    last_name_ = name;
    const std::string full = repeated ? name + "." + std::to_string(numbered_) : name;
    if (repeated) take_name(table, full);
    scene_.names.push_back({full, scene_.bodies.size()});
  }

  const TomlTable& root_;
  Scene& scene_;
  Named<Material> materials_;
  Named<Shape> shapes_;
  World trial_{{.threads = 1}};
  std::set<std::string> taken_;
  std::string last_name_;
  std::size_t numbered_ = 0;
};

}  // namespace

void read_bodies(const TomlTable& root, Scene& scene) {
  BodyReader reader(root, scene);
  const toml::node& node = root.required("body", "write at least one [[body]]");
  if (node.is_table()) root.fail(node, "write [[body]] with two brackets: there may be several");
  for (const toml::node& body : root.as_array(node, "body")) reader.read(root.as_table(body, "body"));
  if (scene.bodies.empty()) root.fail(node, "a scene needs at least one [[body]]");
}

}  // namespace fathom
