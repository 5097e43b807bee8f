#include "scene/pgm_file.hpp"

#include <algorithm>
#include <fathom/error.hpp>

namespace fathom {
namespace {

class PgmReader {
 public:
  PgmReader(std::string_view bytes, const std::string& file) : rest_(bytes), file_(file) {}

  GreyPicture read(std::uint64_t most) {
    if (!rest_.starts_with("P5")) fail("is not a binary grey picture; save it as PGM (P5) with 8 or 16 bits per pixel");
    rest_.remove_prefix(2);
    const std::uint64_t width = read_number(), height = read_number(), white = read_number();
    if (width == 0 || height == 0 || white == 0 || white > 65535 || width > most || height > most)
      fail("has a head that makes no sense; it is 'P5', width, height and the value of white, at most 65535");
    if (width * height > most)
      fail("has " + std::to_string(width * height) + " pixels; " + std::to_string(most) +
           " are the most, so reduce it");
    rest_.remove_prefix(1);  // one blank
    const std::size_t bytes_each = white > 255 ? 2 : 1, pixels = width * height;
    if (rest_.size() < pixels * bytes_each)
      fail("is cut off: it holds " + std::to_string(rest_.size() / bytes_each) + " of its " + std::to_string(pixels) +
           " pixels; copy it again");
    GreyPicture picture{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height), {}};
    picture.pixels.reserve(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const std::uint32_t grey = bytes_each == 1 ? byte(i) : byte(2 * i) << 8 | byte(2 * i + 1);
      picture.pixels.push_back(static_cast<float>(grey) / static_cast<float>(white));
    }
    return picture;
  }

 private:
  [[noreturn]] void fail(const std::string& text) const { throw Error(ErrorCode::file, file_ + ": " + text); }

  std::uint32_t byte(std::size_t i) const { return static_cast<std::uint8_t>(rest_[i]); }

  /// A number of the header, after blanks and comments, followed by at least one byte. 0 if there is none.
  std::uint64_t read_number() {
    for (;;) {
      rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
      if (!rest_.starts_with('#')) break;
      rest_.remove_prefix(std::min(rest_.find('\n'), rest_.size()));
    }
    std::uint64_t value = 0;
    while (!rest_.empty() && rest_[0] >= '0' && rest_[0] <= '9' && value < 1'000'000'000) {
      value = 10 * value + static_cast<std::uint64_t>(rest_[0] - '0');
      rest_.remove_prefix(1);
    }
    return rest_.empty() ? 0 : value;
  }

  std::string_view rest_;
  const std::string& file_;
};

}  // namespace

GreyPicture parse_pgm(std::string_view bytes, const std::string& file, std::uint64_t most) {
  return PgmReader(bytes, file).read(most);
}

}  // namespace fathom
