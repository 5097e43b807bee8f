#include "scene/obj_file.hpp"

#include <algorithm>
#include <charconv>
#include <fathom/error.hpp>
#include <utility>

namespace fathom {
namespace {

/// The words of a text, line by line.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}

  /// False at the end.
  bool next() {
    if (rest_.empty()) return false;
    const std::size_t end = rest_.find('\n');
    line_ = rest_.substr(0, end);
    rest_.remove_prefix(end == rest_.npos ? rest_.size() : end + 1);
    line_ = line_.substr(0, line_.find('#'));
    ++number_;
    return true;
  }

  /// The line's next word, empty at the end of the line.
  std::string_view word() {
    constexpr std::string_view blanks = " \t\r";
    line_.remove_prefix(std::min(line_.find_first_not_of(blanks), line_.size()));
    const std::string_view word = line_.substr(0, line_.find_first_of(blanks));
    line_.remove_prefix(word.size());
    return word;
  }

  int number() const { return number_; }

 private:
  std::string_view rest_, line_;
  int number_ = 0;
};

class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file) : lines_(text), file_(file) { read_.material_number(""); }

  FileTriangles read() {
    while (lines_.next()) {
      const std::string_view keyword = lines_.word();
      if (keyword == "v") read_vertex();
      if (keyword == "f") read_polygon();
      if (keyword == "usemtl") material_ = read_.material_number(std::string(lines_.word()));
    }
    if (read_.indices.empty())
      throw Error(ErrorCode::file, file_ + ": has no line 'f', so no triangle; export the mesh with its faces");
    return std::move(read_);
  }

 private:
  [[noreturn]] void fail(const std::string& text) const {
    throw Error(ErrorCode::file, file_ + ":" + std::to_string(lines_.number()) + ": " + text);
  }

  void read_vertex() {
    Vec3 vertex;
    for (float* coordinate : {&vertex.x, &vertex.y, &vertex.z}) {
      const std::string_view word = lines_.word();
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), *coordinate);
      if (error != std::errc() || end != word.data() + word.size())
        fail("a vertex is 'v x y z', three numbers; '" + std::string(word) + "' does not fit a float");
    }
    if (!is_finite(vertex)) fail("the vertex is not finite; export the mesh again");
    read_.vertices.push_back(vertex);
  }

  /// "7", "7/1", "7/1/3" or "7//3"; counted from 1, or, if negative, back from the last vertex so far.
  std::uint32_t read_corner(std::string_view word) const {
    const std::string_view digits = word.substr(0, word.find('/'));
    const auto count = static_cast<std::int64_t>(read_.vertices.size());
    std::int64_t index = 0;
    const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), index);
    if (error != std::errc() || end != digits.data() + digits.size())
      fail("the corner '" + std::string(word) + "' begins with no whole number; a polygon is 'f 1 2 3'");
    const std::int64_t from_zero = index > 0 ? index - 1 : count + index;
    if (index == 0 || from_zero < 0 || from_zero >= count)
      fail("there is no vertex " + std::to_string(index) + ": " + std::to_string(count) +
           " stand above this line, counted from 1, or from −1 back");
    return static_cast<std::uint32_t>(from_zero);
  }

  void read_polygon() {
    std::uint32_t first = 0, last = 0;
    int corners = 0;
    for (std::string_view word = lines_.word(); !word.empty(); word = lines_.word(), ++corners) {
      const std::uint32_t corner = read_corner(word);
      if (corners == 0) first = corner;
      if (corners >= 2) {
        read_.indices.insert(read_.indices.end(), {first, last, corner});
        read_.material_of.push_back(material_);
      }
      last = corner;
    }
    if (corners < 3) fail("a polygon has at least 3 corners, not " + std::to_string(corners) + "; remove the line");
  }

  Lines lines_;
  const std::string& file_;
  FileTriangles read_;
  std::uint32_t material_ = 0;
};

}  // namespace

FileTriangles parse_obj(std::string_view text, const std::string& file) { return ObjReader(text, file).read(); }

}  // namespace fathom
