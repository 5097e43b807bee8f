// Typed, checked reading of TOML tables. Every error message is one `Error{file}` of the form "scene.toml:12:5: unknown
// key 'mas' in [[body]]; did you mean 'mass'?".
#pragma once

#include <toml++/toml.h>

#include <cstdint>
#include <fathom/error.hpp>
#include <fathom/math.hpp>
#include <initializer_list>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fathom {

/// Range of numbers that a key accepts.
enum class Range : std::uint8_t { any, not_negative, positive, unit_interval };

/// A table of the file at `file`, `name` in error messages; it may contain only the known keys.
class TomlTable {
 public:
  TomlTable(const toml::table& table, std::string name, std::string_view file,
            std::initializer_list<std::string_view> known);

  /// A table with any keys.
  TomlTable(const toml::table& table, std::string name, std::string_view file);

  bool has(std::string_view key) const { return table_.contains(key); }

  // These leave `value` unchanged if the key is absent.
  void read(std::string_view key, float& value, Range range = Range::any) const;
  void read(std::string_view key, std::optional<float>& value, Range range = Range::any) const;
  void read(std::string_view key, int& value, int least, int most = std::numeric_limits<int>::max()) const;
  void read(std::string_view key, std::uint32_t& value) const;
  void read(std::string_view key, std::uint64_t& value) const;
  /// 64 bits as a TOML integer: −1 sets all of them.
  void read_bits(std::string_view key, std::uint64_t& value) const;
  void read(std::string_view key, bool& value) const;
  void read(std::string_view key, std::string& value) const;
  void read(std::string_view key, Vec3& value, Range range = Range::any) const;
  /// A unit quaternion from [w, x, y, z], or {axis = [x, y, z], angle = radians}.
  void read(std::string_view key, Quat& value) const;

  /// Reads a word from a fixed list as its value.
  template <class T>
  void read_choice(std::string_view key, T& value, std::span<const std::pair<std::string_view, T>> choices) const {
    if (!has(key)) return;
    std::vector<std::string_view> words;
    for (const auto& choice : choices) words.push_back(choice.first);
    value = choices[choice_index(key, words)].second;
  }

  /// The value of a mandatory key.
  const toml::node& required(std::string_view key, std::string_view remedy) const;
  const toml::node* find(std::string_view key) const { return table_.get(key); }

  /// Between `least` and `most` finite numbers.
  std::vector<float> numbers(const toml::node& node, std::string_view what, std::size_t least, std::size_t most) const;
  const toml::table& as_table(const toml::node& node, std::string_view what) const;
  const toml::array& as_array(const toml::node& node, std::string_view what) const;

  /// Throws an error located at a value, or at the head of this table.
  [[noreturn]] void fail(const toml::node& at, const std::string& text) const;
  [[noreturn]] void fail(const std::string& text) const { fail(table_, text); }

  const toml::table& table() const { return table_; }
  const std::string& name() const { return name_; }
  std::string_view file() const { return file_; }

 private:
  std::size_t choice_index(std::string_view key, std::span<const std::string_view> words) const;
  std::int64_t integer(const toml::node& node, std::string_view key, std::int64_t least, std::int64_t most) const;
  float number(const toml::node& node, std::string_view what, Range range) const;

  const toml::table& table_;
  std::string name_;
  std::string_view file_;
};

/// Parses a text. Throws an `Error{file}` that says where it is not TOML, and what to write instead.
toml::table parse_toml(std::string_view text, std::string_view file);

/// "file:line:column: text" as an `Error{file}`.
[[noreturn]] void fail_at(std::string_view file, const toml::source_region& where, const std::string& text);

}  // namespace fathom
