// Options and work of `fathom bench peers` and `fathom_peers`.
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
enum class Outcome {
  good,
  failed,       ///< an engine lost a body, or a state was not finite
  interrupted,  ///< by Ctrl-C: the table shows what was measured, earlier results are unchanged
};
/// Throws `Error` if a scene or an engine does not exist, as `run` does, but creates no files.
void check(const Options& options);
/// Measures, prints the table, writes the JSON.
Outcome run(const Options& options);

}  // namespace fathom::peers
