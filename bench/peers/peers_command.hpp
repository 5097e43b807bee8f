// What `fathom bench peers` and `fathom_peers` are asked for, and their work.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace fathom::peers {

struct Options {
  std::vector<std::string> scenes;
  std::vector<std::string> engines;
  std::vector<int> threads{1, 2};
  int steps = 0;
  int rounds = 3;
  double limit = 60;  ///< s
  bool quick = false;
  std::string json;
};

void declare(CLI::App& app, Options& options);
/// Measures, prints the table, writes the JSON. Returns whether every engine did what it should.
bool run(const Options& options);

}  // namespace fathom::peers
