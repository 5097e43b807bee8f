#include "scene/toml_reader.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/suggest.hpp"

namespace fathom {
namespace {

std::string quoted(std::string_view text) { return "'" + std::string(text) + "'"; }

/// Names the type of a value in the file.
std::string_view type_name(const toml::node& node) {
  switch (node.type()) {
    case toml::node_type::table:
      return "a table";
    case toml::node_type::array:
      return "an array";
    case toml::node_type::string:
      return "a string";
    case toml::node_type::integer:
      return "an integer";
    case toml::node_type::floating_point:
      return "a number";
    case toml::node_type::boolean:
      return "a boolean";
    default:
      return "a date or time";
  }
}

std::string must_be(std::string_view what, std::string_view wanted, const toml::node& node) {
  return quoted(what) + " must be " + std::string(wanted) + ", not " + std::string(type_name(node));
}

/// What is wrong with the number, or empty.
std::string_view complaint(float value, Range range) {
  if (!is_finite(value)) return "must be finite";
  if (range == Range::positive && value <= 0) return "must be greater than 0";
  if (range == Range::not_negative && value < 0) return "must not be negative";
  if (range == Range::unit_interval && (value < 0 || value > 1)) return "must be between 0 and 1";
  return {};
}

Quat read_axis_angle(const TomlTable& table) {
  Vec3 axis;
  float angle = 0;
  const std::string remedy = "write " + table.name() + " = {axis = [x, y, z], angle = radians}";
  const toml::node& node = table.required("axis", remedy);
  table.required("angle", remedy);
  table.read("axis", axis);
  table.read("angle", angle);
  if (!(length_squared(axis) > 1e-12f)) table.fail(node, "'axis' has no length; it points along the axis of rotation");
  const Vec3 v = static_cast<float>(std::sin(0.5 * static_cast<double>(angle))) * normalize(axis);
  return {static_cast<float>(std::cos(0.5 * static_cast<double>(angle))), v.x, v.y, v.z};
}

}  // namespace

void fail_at(std::string_view file, const toml::source_region& where, const std::string& text) {
  throw Error(ErrorCode::file, std::string(file) + ":" + std::to_string(where.begin.line) + ":" +
                                   std::to_string(where.begin.column) + ": " + text);
}

TomlTable::TomlTable(const toml::table& table, std::string name, std::string_view file)
    : table_(table), name_(std::move(name)), file_(file) {}

TomlTable::TomlTable(const toml::table& table, std::string name, std::string_view file,
                     std::initializer_list<std::string_view> known)
    : TomlTable(table, std::move(name), file) {
  const toml::key* unknown = nullptr;  // the first in the file; the table is sorted by key
  for (const auto& [key, value] : table) {
    if (std::find(known.begin(), known.end(), key.str()) != known.end()) continue;
    if (!unknown || key.source().begin < unknown->source().begin) unknown = &key;
  }
  if (!unknown) return;
  fail_at(file_, unknown->source(),
          "unknown key " + quoted(unknown->str()) + " in " + name_ +
              suggestion(unknown->str(), {known.begin(), known.size()}));
}

void TomlTable::fail(const toml::node& at, const std::string& text) const { fail_at(file_, at.source(), text); }

void TomlTable::read(std::string_view key, float& value, Range range) const {
  if (const toml::node* node = find(key)) value = number(*node, key, range);
}

void TomlTable::read(std::string_view key, std::optional<float>& value, Range range) const {
  if (const toml::node* node = find(key)) value = number(*node, key, range);
}

void TomlTable::read(std::string_view key, int& value, int least, int most) const {
  if (const toml::node* node = find(key)) value = static_cast<int>(integer(*node, key, least, most));
}

void TomlTable::read(std::string_view key, std::uint32_t& value) const {
  if (const toml::node* node = find(key)) {
    value = static_cast<std::uint32_t>(integer(*node, key, 0, std::numeric_limits<std::uint32_t>::max()));
  }
}

void TomlTable::read(std::string_view key, std::uint64_t& value) const {
  if (const toml::node* node = find(key)) {
    value = static_cast<std::uint64_t>(integer(*node, key, 0, std::numeric_limits<std::int64_t>::max()));
  }
}

void TomlTable::read_bits(std::string_view key, std::uint64_t& value) const {
  using Limits = std::numeric_limits<std::int64_t>;
  if (const toml::node* node = find(key))
    value = static_cast<std::uint64_t>(integer(*node, key, Limits::min(), Limits::max()));
}

void TomlTable::read(std::string_view key, bool& value) const {
  const toml::node* node = find(key);
  if (!node) return;
  if (!node->is_boolean()) fail(*node, must_be(key, "true or false", *node));
  value = node->as_boolean()->get();
}

void TomlTable::read(std::string_view key, std::string& value) const {
  const toml::node* node = find(key);
  if (!node) return;
  if (!node->is_string()) fail(*node, must_be(key, "a string", *node));
  value = node->as_string()->get();
}

void TomlTable::read(std::string_view key, Vec3& value, Range range) const {
  const toml::node* node = find(key);
  if (!node) return;
  const std::vector<float> v = numbers(*node, key, 3, 3);
  for (const float component : v) {
    if (const auto wrong = complaint(component, range); !wrong.empty()) {
      fail(*node, "every component of " + quoted(key) + " " + std::string(wrong));
    }
  }
  value = {v[0], v[1], v[2]};
}

void TomlTable::read(std::string_view key, Quat& value) const {
  const toml::node* node = find(key);
  if (!node) return;
  if (node->is_table()) {
    value = read_axis_angle({*node->as_table(), std::string(key), file_, {"axis", "angle"}});
    return;
  }
  const std::vector<float> v = numbers(*node, key, 4, 4);
  const Quat q{v[0], v[1], v[2], v[3]};
  if (!(dot(q, q) > 1e-12f)) fail(*node, quoted(key) + " is all 0; write [1, 0, 0, 0] for a body that is not turned");
  value = normalize(q);
}

const toml::node& TomlTable::required(std::string_view key, std::string_view remedy) const {
  if (const toml::node* node = find(key)) return *node;
  fail(name_ + " needs " + quoted(key) + ": " + std::string(remedy));
}

std::vector<float> TomlTable::numbers(const toml::node& node, std::string_view what, std::size_t least,
                                      std::size_t most) const {
  const toml::array& array = as_array(node, what);
  if (array.size() < least || array.size() > most) {
    const std::string range =
        least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most);
    fail(node, quoted(what) + " must have " + range + " numbers, not " + std::to_string(array.size()));
  }
  std::vector<float> values;
  for (const toml::node& element : array) values.push_back(number(element, what, Range::any));
  return values;
}

const toml::table& TomlTable::as_table(const toml::node& node, std::string_view what) const {
  if (!node.is_table()) fail(node, must_be(what, "a table", node));
  return *node.as_table();
}

const toml::array& TomlTable::as_array(const toml::node& node, std::string_view what) const {
  if (!node.is_array()) fail(node, must_be(what, "an array", node));
  return *node.as_array();
}

std::size_t TomlTable::choice_index(std::string_view key, std::span<const std::string_view> words) const {
  std::string word;
  read(key, word);
  const auto found = std::find(words.begin(), words.end(), word);
  if (found == words.end())
    fail(*find(key), quoted(word) + " is not a valid " + std::string(key) + suggestion(word, words));
  return static_cast<std::size_t>(found - words.begin());
}

std::int64_t TomlTable::integer(const toml::node& node, std::string_view key, std::int64_t least,
                                std::int64_t most) const {
  if (!node.is_integer()) fail(node, must_be(key, "an integer", node));
  const std::int64_t value = node.as_integer()->get();
  if (value < least || value > most) {
    fail(node, quoted(key) + " must be between " + std::to_string(least) + " and " + std::to_string(most) + ", not " +
                   std::to_string(value));
  }
  return value;
}

float TomlTable::number(const toml::node& node, std::string_view what, Range range) const {
  const std::optional<double> read = node.value<double>();
  if (!node.is_number() || !read) fail(node, must_be(what, "a number", node));
  const auto value = static_cast<float>(*read);
  if (const auto wrong = complaint(value, range); !wrong.empty()) fail(node, quoted(what) + " " + std::string(wrong));
  return value;
}

}  // namespace fathom
