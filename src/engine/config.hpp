// The engine's configuration: a TOML file, single keys from the command line, and where each value came from.
// docs/engine.md lists the keys.
#pragma once

#include <fathom/world.hpp>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/simulation.hpp"

namespace fathom::engine {

enum class Pacing : std::uint8_t {
  free,   ///< as fast as possible
  fixed,  ///< `loop.rate` frames a second
  vsync,  ///< as the display asks; like `fixed` where the front end has no display
};

/// How many steps a frame makes.
enum class TimeSource : std::uint8_t {
  steps,  ///< one, however long it takes
  wall,   ///< as many as wall time asks for
};

/// The values. Each is a key of the file: `simulator.threads` is `Settings::simulator.threads`.
struct Settings {
  struct {
    SimulatorKind kind = SimulatorKind::native;
    std::string device = "auto";
    bool fallback = true;
    int threads = 0;
    SimulationMode mode = SimulationMode::lockstep;
    int ahead = 1;
    float dt = 1.0f / 60.0f;
    int substeps = 4;
    Solver solver = Solver::soft;
    BroadPhase broad_phase = BroadPhase::tree;
    Partition partition = Partition::colours;
    bool warm_start = true;
    Preset preset = Preset::fathom;
    bool sleep = true;
    Vec3 gravity{0, 0, -9.81f};
    bool hashes = false;
  } simulator;
  struct {
    Pacing pacing = Pacing::free;
    double rate = 60;
    TimeSource time = TimeSource::steps;
    double time_scale = 1;
    bool paused = false;
    int max_steps_per_frame = 4;
  } loop;
  struct {
    int spawns_per_frame = 1024;
  } world;
  struct {
    bool enabled = false;
    int width = 1280;
    int height = 720;
    bool fullscreen = false;
    std::string title = "Fathom";
  } window;
  struct {
    std::string level = "info";
    bool console = true;
    std::string file;
    int file_size = 8;
    int files = 3;
    std::string data;
  } log;
  struct {
    std::string file;
  } trace;
  struct {
    std::string file;
    int snapshot_every = 300;
    bool states = true;
  } record;
  /// `input.actions.<action> = "key"` or `["key", …]`.
  std::map<std::string, std::vector<std::string>> actions;
};

class Config {
 public:
  Config();

  /// Reads a file over the present values. Throws `Error{file}` that names file, line, key and remedy, and
  /// then changes nothing.
  void load(const std::string& path);
  /// The same from text; `file` is what complaints call it.
  void parse(std::string_view text, std::string_view file);
  /// Sets one key from "simulator.threads=4"; `value` is TOML, quotes around words may be left out. Throws
  /// `Error{invalid_argument}`.
  void set(std::string_view assignment);
  /// Writes all values as a file that `load` reads; complete or not at all. Throws `Error{file}`.
  void save(const std::string& path) const;

  /// The values as a TOML file; with `origins` each line ends in a comment that says where its value came from.
  std::string text(bool origins) const;
  /// "default", "engine.toml:3" or "--set".
  const std::string& origin(std::string_view key) const;
  std::vector<std::string> keys() const;

  const Settings& operator*() const { return values_; }
  const Settings* operator->() const { return &values_; }
  /// For programs that set values themselves; their origin stays what it was.
  Settings& edit() { return values_; }

  /// Puts those simulator settings over a definition that do not have their default's origin.
  void override_world(WorldDef& def) const;
  /// The world these settings ask for; `log` gets the lines of the library.
  WorldDef world_definition(std::function<void(std::string_view)> log = {}) const;

 private:
  Settings values_;
  std::map<std::string, std::string, std::less<>> origins_;
};

}  // namespace fathom::engine
