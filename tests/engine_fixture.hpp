// What tests of the engine share.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "engine/engine.hpp"
#include "world_fixture.hpp"

namespace fathom::engine::test {

using fathom::test::cube;
using fathom::test::ground;

/// Without messages on the console.
inline Config quiet_config() {
  Config config;
  config.edit().log.console = false;
  config.edit().simulator.threads = 1;
  return config;
}

/// A folder that goes with its test.
class Folder {
 public:
  Folder() {
    std::string pattern = testing::TempDir() + "/fathom-engine-XXXXXX";
    folder_ = mkdtemp(pattern.data());
  }
  ~Folder() { std::filesystem::remove_all(folder_); }
  std::string operator/(const std::string& name) const { return (folder_ / name).string(); }
  std::size_t file_count() const {
    std::size_t count = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_)) ++count;
    return count;
  }

 private:
  std::filesystem::path folder_;
};

inline std::string read_text(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

/// What the error says that `act` throws, or "" where it throws none.
template <class Act>
std::string refusal(const Act& act) {
  try {
    act();
  } catch (const Error& error) {
    return error.what();
  }
  return {};
}

}  // namespace fathom::engine::test
