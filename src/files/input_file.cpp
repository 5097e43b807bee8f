#include "files/input_file.hpp"

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fathom/error.hpp>
#include <memory>

namespace fathom::files {

std::string read_file(const std::string& path, const std::string& remedy) {
  const auto fail = [&] {
    throw Error(ErrorCode::file, path + ": cannot be read (" + std::strerror(errno) + "); " + remedy);
  };
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  const std::unique_ptr<std::FILE, Close> file(std::fopen(path.c_str(), "rbe"));
  if (!file) fail();
  std::string text;
  std::array<char, 1 << 14> bytes;
  while (const std::size_t size = std::fread(bytes.data(), 1, bytes.size(), file.get()))
    text.append(bytes.data(), size);
  if (std::ferror(file.get())) fail();
  return text;
}

}  // namespace fathom::files
