// Command-line options of the engine: its configuration, and replays.
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}
namespace fathom::engine {
class Config;
}

namespace fathom::cli {

/// A configuration file and individual keys that override it.
struct ConfigSources {
  std::string file;
  std::vector<std::string> sets;  ///< "key=value"

  /// Throws `Error` for a bad file or key.
  engine::Config load() const;
};

struct ReplayOptions {
  std::string file;
  int threads = 0;
  std::string device = "auto";
  bool quiet = false;
};

void declare_config_sources(CLI::App& command, ConfigSources& sources);
void declare_replay(CLI::App& command, ReplayOptions& options);

/// Repeats a recording and compares: `finished`, or `failed` if it differs.
int replay(const ReplayOptions& options);

}  // namespace fathom::cli
