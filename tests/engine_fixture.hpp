// Shared by the tests of the engine.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "engine/engine.hpp"
#include "test_folder.hpp"
#include "world_fixture.hpp"

namespace fathom::engine::test {

using fathom::test::cube;
using fathom::test::ground;
using fathom::test::read_text;
using Folder = fathom::test::TestFolder;

/// Without messages on the console.
inline Config quiet_config() {
  Config config;
  config.edit().log.console = false;
  config.edit().simulator.threads = 1;
  return config;
}

/// The message of the error that `act` throws, or "" if it throws none.
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
