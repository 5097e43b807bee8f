// The engine's configuration: a TOML file, single keys from the command line, and the origin of each value.
// docs/engine.md lists the keys.
#pragma once

#include <fathom/world.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/simulation.hpp"

namespace fathom::engine {

enum class Pacing : std::uint8_t {
  free,   ///< as fast as possible
  fixed,  ///< `loop.rate` frames per second
  vsync,  ///< paced by the display; like `fixed` if the front end has none
};

/// How many steps a frame takes.
enum class TimeSource : std::uint8_t {
  steps,  ///< one, however long it takes
  wall,   ///< as many as wall time requires
};

/// The values. Each is a key of the file: `simulator.threads` is `Settings::simulator.threads`.
struct Settings {
  struct Simulator {
    SimulatorKind kind = SimulatorKind::native;
    std::string device = "auto";
    bool fallback = true;
    int threads = 0;
    SimulationMode mode = SimulationMode::lockstep;
    int ahead = 1;
    int device_ahead = 0;
    float dt = 1.0f / 60.0f;
    int substeps = 4;
    Solver solver = Solver::soft;
    int iterations = 10;
    int marking_rounds = 32;
    float contact_hertz = SolverSettings{}.contact_hertz;
    float contact_damping_ratio = SolverSettings{}.contact_damping_ratio;
    float push_out_velocity = SolverSettings{}.push_out_velocity;
    float restitution_threshold = SolverSettings{}.restitution_threshold;
    float max_linear_speed = SolverSettings{}.max_linear_speed;
    BroadPhase broad_phase = BroadPhase::tree;
    Vec3 sweep_axis = WorldDef{}.sweep_axis;
    Partition partition = Partition::colours;
    bool warm_start = true;
    bool direct_joints = true;
    Preset preset = Preset::fathom;
    bool sleep = true;
    float sleep_linear_speed = SleepSettings{}.linear_speed;
    float sleep_time = SleepSettings{}.time;
    int max_bodies = static_cast<int>(WorldDef{}.max_bodies);
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

/// The source of a value. Later sources in this order win; a preset sets everything that it decides.
enum class Setter : std::uint8_t { nobody, scene, file, assignment, option, program };

/// The base world of a configuration: it determines what is not set.
struct WorldBase {
  WorldDef world{};
  std::string name{};                                      ///< of the scene
  std::optional<Preset> preset{};                          ///< requested by the scene
  std::map<std::string, std::string, std::less<>> said{};  ///< where the scene sets each key ("scene.toml:12")
};

class Config {
 public:
  Config();

  /// Reads a file over the current values. If it throws `Error{file}`, which names file, line, key and remedy, nothing
  /// changes.
  void load(const std::string& path);
  /// The same from text; `file` is its name in error messages.
  void parse(std::string_view text, std::string_view file);
  /// Sets one key from "simulator.threads=4"; `value` is TOML, with optional quotes around words. Throws
  /// `Error{invalid_argument}`.
  void set(std::string_view assignment);
  /// Sets one key as a command-line option, over files and assignments; `option` is its name for `origin`.
  void give(std::string_view key, std::string_view option, const std::function<void(Settings&)>& change,
            Setter setter = Setter::option);
  /// Sets the base world.
  void set_base(WorldBase base);
  /// Atomically writes a file that `load` reads back as this configuration, with unset keys as comments. Throws
  /// `Error{file}`.
  void save(const std::string& path) const;

  /// The values as a TOML file, unset ones as comments; with `origins` each line ends in a comment with the origin of
  /// its value.
  std::string text(bool origins) const;
  /// "default", "engine.toml:3", "--set", "--solver", "program", "preset dissertation", or, from the scene, its name or
  /// "scene.toml:12".
  std::string origin(std::string_view key) const;
  /// Whether a file, an assignment, an option or the program set the value.
  bool is_set(std::string_view key) const;
  std::vector<std::string> keys() const;

  /// The values in effect; effects of an edited preset show only in `settled`.
  const Settings& operator*() const { return values_; }
  const Settings* operator->() const { return &values_; }
  /// For programs that set values themselves. Values left unchanged count as not set.
  Settings& edit() { return values_; }
  /// The configuration with all effects of edits.
  Config settled() const;

  /// The world defined by base and settings; `log` receives the library's messages.
  WorldDef world_definition(std::function<void(std::string_view)> log = {}) const;

 private:
  struct Origin {
    Setter setter = Setter::nobody;
    std::string text;
  };

  Setter setter_of(std::string_view key) const;
  Setter setter_of_preset() const;
  bool device_implies_simulator() const;
  bool is_decided_by_preset(std::string_view key) const;
  bool counts(std::string_view key) const;
  std::string origin_of(std::string_view key) const;
  void note_edits();
  void settle();

  Settings values_;
  Settings settled_;                                    // as last settled; differences are edits
  std::map<std::string, Origin, std::less<>> origins_;  // of set values
  WorldBase base_;
};

}  // namespace fathom::engine
