#include "engine/config_keys.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>
#include <vector>

#include "engine/input.hpp"
#include "engine/log.hpp"
#include "scene/suggest.hpp"

namespace fathom::engine {
namespace {

/// The invalid number; nothing for other types, which the requirement excludes.
std::string not_this(const toml::node& node) {
  if (const toml::value<std::int64_t>* integer = node.as_integer()) return fmt::format(", not {}", integer->get());
  if (const toml::value<double>* number = node.as_floating_point()) return fmt::format(", not {}", number->get());
  return {};
}

// `At` is a generic lambda from settings to the value: one lambda serves both reading and writing.

template <class At>
ConfigKey integer(std::string name, std::string help, std::int64_t least, std::int64_t most, At at) {
  return {std::move(name), std::move(help), false,
          [=](Settings& s, const toml::node& node) {
            const auto value = node.is_integer() ? node.value<std::int64_t>() : std::nullopt;
            if (!value || *value < least || *value > most)
              throw fmt::format("must be a whole number from {} to {}{}", least, most, not_this(node));
            at(s) = static_cast<std::decay_t<decltype(at(s))>>(*value);
          },
          [=](const Settings& s) { return fmt::format("{}", at(s)); }};
}

template <class At>
ConfigKey real(std::string name, std::string help, double least, double most, At at) {
  return {std::move(name), std::move(help), false,
          [=](Settings& s, const toml::node& node) {
            const auto value = node.is_number() ? node.value<double>() : std::nullopt;
            if (!value || !(*value >= least && *value <= most))
              throw fmt::format("must be a number from {} to {}{}", least, most, not_this(node));
            at(s) = static_cast<std::decay_t<decltype(at(s))>>(*value);
          },
          [=](const Settings& s) { return fmt::format("{}", at(s)); }};
}

/// A finite single-precision number, greater than 0 or at least 0.
template <class At>
ConfigKey amount(std::string name, std::string help, bool positive, At at) {
  return {std::move(name), std::move(help), false,
          [=](Settings& s, const toml::node& node) {
            const auto value = static_cast<float>(node.value<double>().value_or(-1));
            if (!node.is_number() || !std::isfinite(value) || !(positive ? value > 0 : value >= 0))
              throw fmt::format("must be a finite number {}{}", positive ? "greater than 0" : "of at least 0",
                                not_this(node));
            at(s) = value;
          },
          [=](const Settings& s) { return fmt::format("{}", at(s)); }};
}

template <class At>
ConfigKey boolean(std::string name, std::string help, At at) {
  return {std::move(name), std::move(help), false,
          [=](Settings& s, const toml::node& node) {
            if (!node.is_boolean()) throw std::string("must be true or false");
            at(s) = node.as_boolean()->get();
          },
          [=](const Settings& s) { return std::string(at(s) ? "true" : "false"); }};
}

template <class At>
ConfigKey text(std::string name, std::string help, At at) {
  return {std::move(name), std::move(help), true,
          [=](Settings& s, const toml::node& node) {
            if (!node.is_string()) throw std::string("must be a string");
            at(s) = node.as_string()->get();
          },
          [=](const Settings& s) { return quoted_toml(at(s)); }};
}

template <class T, class At>
ConfigKey choice(std::string name, std::string help, std::vector<std::pair<std::string_view, T>> words, At at) {
  return {std::move(name), std::move(help), true,
          [=](Settings& s, const toml::node& node) {
            std::vector<std::string_view> known;
            for (const auto& [word, value] : words) known.push_back(word);
            if (!node.is_string()) throw fmt::format("must be one of {}", fmt::join(known, ", "));
            const std::string given = node.as_string()->get();
            for (const auto& [word, value] : words) {
              if (word != given) continue;
              at(s) = static_cast<std::decay_t<decltype(at(s))>>(value);
              return;
            }
            throw fmt::format("must be one of {}, not '{}'{}", fmt::join(known, ", "), given,
                              nearest(given, known).empty() ? "" : suggestion(given, known));
          },
          [=](const Settings& s) {
            for (const auto& [word, value] : words)
              if (at(s) == value) return quoted_toml(word);
            return std::string();
          }};
}

/// Three finite numbers that satisfy is_good; `what` describes that condition.
template <class At>
ConfigKey vector(std::string name, std::string help, std::string what, bool (*is_good)(Vec3), At at) {
  return {std::move(name), std::move(help), false,
          [=](Settings& s, const toml::node& node) {
            const toml::array* array = node.as_array();
            float v[3] = {};
            bool good = array && array->size() == 3;
            for (std::size_t i = 0; good && i < 3; ++i) {
              const toml::node& element = *array->get(i);
              v[i] = element.is_number() ? static_cast<float>(*element.value<double>()) : NAN;
              good = std::isfinite(v[i]);
            }
            if (!good || !is_good({v[0], v[1], v[2]})) throw "must be three finite numbers" + what;
            at(s) = {v[0], v[1], v[2]};
          },
          [=](const Settings& s) { return fmt::format("[{}, {}, {}]", at(s).x, at(s).y, at(s).z); }};
}

bool is_axis(Vec3 v) { return min_component(v) >= 0 && length(v) > 1e-6f; }

/// The numeric keys of SolverSettings and SleepSettings.
std::vector<ConfigKey> solver_keys() {
  return {
      integer(
          "simulator.iterations", "sweeps per substep of solver impulse", 1, 1000,
          [](auto& s) -> auto& { return s.simulator.iterations; }),
      integer(
          "simulator.marking_rounds", "batches that a cell of a device can have", 1, 255,
          [](auto& s) -> auto& { return s.simulator.marking_rounds; }),
      amount(
          "simulator.contact_hertz", "Hz, stiffness of contacts, capped at 0.15 of the substep rate", true,
          [](auto& s) -> auto& { return s.simulator.contact_hertz; }),
      amount(
          "simulator.contact_damping_ratio", "of contacts; 1 is critical", false,
          [](auto& s) -> auto& { return s.simulator.contact_damping_ratio; }),
      amount(
          "simulator.push_out_velocity", "m/s at most to resolve a penetration", false,
          [](auto& s) -> auto& { return s.simulator.push_out_velocity; }),
      amount(
          "simulator.restitution_threshold", "m/s of approach below which nothing bounces", false,
          [](auto& s) -> auto& { return s.simulator.restitution_threshold; }),
      amount(
          "simulator.max_linear_speed", "m/s; faster bodies are slowed to it", true,
          [](auto& s) -> auto& { return s.simulator.max_linear_speed; }),
      boolean(
          "simulator.sleep", "resting islands sleep", [](auto& s) -> auto& { return s.simulator.sleep; }),
      amount(
          "simulator.sleep_linear_speed", "m/s below which a body may fall asleep", false,
          [](auto& s) -> auto& { return s.simulator.sleep_linear_speed; }),
      amount(
          "simulator.sleep_time", "s that an island must have been slow", false,
          [](auto& s) -> auto& { return s.simulator.sleep_time; }),
  };
}

std::vector<ConfigKey> simulator_keys() {
  return {
      choice<SimulatorKind>(
          "simulator.kind", "native, device or hybrid",
          {{"native", SimulatorKind::native}, {"device", SimulatorKind::device}, {"hybrid", SimulatorKind::hybrid}},
          [](auto& s) -> auto& { return s.simulator.kind; }),
      text(
          "simulator.device",
          "of the device simulator: auto (the first GPU, else the host), host, cuda[:index], sycl[:index]",
          [](auto& s) -> auto& { return s.simulator.device; }),
      boolean(
          "simulator.fallback", "go on with the native simulator where the device is not there",
          [](auto& s) -> auto& { return s.simulator.fallback; }),
      integer(
          "simulator.threads", "0: as many as the machine has", 0, WorldDef::max_threads,
          [](auto& s) -> auto& { return s.simulator.threads; }),
      choice<SimulationMode>(
          "simulator.mode", "how the game keeps step with the simulation: lockstep, ahead, async",
          {{"lockstep", SimulationMode::lockstep}, {"ahead", SimulationMode::ahead}, {"async", SimulationMode::async}},
          [](auto& s) -> auto& { return s.simulator.mode; }),
      integer(
          "simulator.ahead", "steps that mode ahead simulates ahead of what is drawn", 1, 64,
          [](auto& s) -> auto& { return s.simulator.ahead; }),
      integer(
          "simulator.device_ahead", "steps that the device simulator may be ahead of what is read", 0, 16,
          [](auto& s) -> auto& { return s.simulator.device_ahead; }),
      real(
          "simulator.dt", "s, the fixed time step", 1e-6, 1, [](auto& s) -> auto& { return s.simulator.dt; }),
      integer(
          "simulator.substeps", "of a step", 1, SolverSettings::max_substeps,
          [](auto& s) -> auto& { return s.simulator.substeps; }),
      choice<Preset>(
          "simulator.preset", "algorithms: fathom, dissertation; the keys below change parts of it",
          {{"fathom", Preset::fathom}, {"dissertation", Preset::dissertation}},
          [](auto& s) -> auto& { return s.simulator.preset; }),
      choice<Solver>(
          "simulator.solver", "soft, impulse", {{"soft", Solver::soft}, {"impulse", Solver::impulse}},
          [](auto& s) -> auto& { return s.simulator.solver; }),
      choice<BroadPhase>(
          "simulator.broad_phase", "tree, sweep", {{"tree", BroadPhase::tree}, {"sweep", BroadPhase::sweep}},
          [](auto& s) -> auto& { return s.simulator.broad_phase; }),
      choice<Partition>(
          "simulator.partition", "colours, cells", {{"colours", Partition::colours}, {"cells", Partition::cells}},
          [](auto& s) -> auto& { return s.simulator.partition; }),
      boolean(
          "simulator.warm_start", "contacts begin with their last impulses",
          [](auto& s) -> auto& { return s.simulator.warm_start; }),
      boolean(
          "simulator.direct_joints", "mechanisms of rigid joints are solved directly, not by sweeps",
          [](auto& s) -> auto& { return s.simulator.direct_joints; }),
      vector(
          "simulator.sweep_axis", "of broad phase sweep, three numbers", " of at least 0, not all 0, e.g. [3, 2, 1]",
          is_axis, [](auto& s) -> auto& { return s.simulator.sweep_axis; }),
      vector(
          "simulator.gravity", "m/s², three numbers", ", e.g. [0, 0, -9.81]", [](Vec3) { return true; },
          [](auto& s) -> auto& { return s.simulator.gravity; }),
      integer(
          "simulator.max_bodies", "that a world may have", 1, WorldDef{}.max_bodies,
          [](auto& s) -> auto& { return s.simulator.max_bodies; }),
      boolean(
          "simulator.hashes", "compute the state hash of every step",
          [](auto& s) -> auto& { return s.simulator.hashes; }),
  };
}

std::vector<ConfigKey> loop_keys() {
  return {
      choice<Pacing>(
          "loop.pacing", "frames: free (as fast as possible), fixed, vsync",
          {{"free", Pacing::free}, {"fixed", Pacing::fixed}, {"vsync", Pacing::vsync}},
          [](auto& s) -> auto& { return s.loop.pacing; }),
      real(
          "loop.rate", "frames per second of pacing fixed", 1, 10000, [](auto& s) -> auto& { return s.loop.rate; }),
      choice<TimeSource>(
          "loop.time", "steps of a frame: steps (one) or wall (as many as wall time asks for)",
          {{"steps", TimeSource::steps}, {"wall", TimeSource::wall}}, [](auto& s) -> auto& { return s.loop.time; }),
      real(
          "loop.time_scale", "simulated seconds per second of wall time", 0, 1000,
          [](auto& s) -> auto& { return s.loop.time_scale; }),
      boolean(
          "loop.paused", "start paused", [](auto& s) -> auto& { return s.loop.paused; }),
      integer(
          "loop.max_steps_per_frame", "steps that wall time may ask of a frame; what is beyond is given up", 1, 1000,
          [](auto& s) -> auto& { return s.loop.max_steps_per_frame; }),
      integer(
          "world.spawns_per_frame", "entities that may be spawned in a frame", 1, 1 << 30,
          [](auto& s) -> auto& { return s.world.spawns_per_frame; }),
      boolean(
          "window.enabled", "open a window", [](auto& s) -> auto& { return s.window.enabled; }),
      integer(
          "window.width", "pixels", 16, 16384, [](auto& s) -> auto& { return s.window.width; }),
      integer(
          "window.height", "pixels", 16, 16384, [](auto& s) -> auto& { return s.window.height; }),
      boolean(
          "window.fullscreen", "cover the whole screen", [](auto& s) -> auto& { return s.window.fullscreen; }),
      text(
          "window.title", "of the window", [](auto& s) -> auto& { return s.window.title; }),
  };
}

std::vector<ConfigKey> file_keys() {
  return {
      choice<std::string>(
          "log.level", "trace, debug, info, warning, error, off",
          {{"trace", "trace"},
           {"debug", "debug"},
           {"info", "info"},
           {"warning", "warning"},
           {"error", "error"},
           {"off", "off"}},
          [](auto& s) -> auto& { return s.log.level; }),
      boolean(
          "log.console", "messages to stderr", [](auto& s) -> auto& { return s.log.console; }),
      text(
          "log.file", "messages to this file too", [](auto& s) -> auto& { return s.log.file; }),
      integer(
          "log.file_size", "MiB after which a new file is started", 1, 1024,
          [](auto& s) -> auto& { return s.log.file_size; }),
      integer(
          "log.files", "old log files kept", 0, 100, [](auto& s) -> auto& { return s.log.files; }),
      text(
          "log.data", "data series to this CSV file", [](auto& s) -> auto& { return s.log.data; }),
      text(
          "trace.file", "profile zones to this Chrome trace", [](auto& s) -> auto& { return s.trace.file; }),
      text(
          "record.file", "record the run to this file", [](auto& s) -> auto& { return s.record.file; }),
      integer(
          "record.snapshot_every", "steps between snapshots", 1, 1 << 30,
          [](auto& s) -> auto& { return s.record.snapshot_every; }),
      boolean(
          "record.states", "record every step's state", [](auto& s) -> auto& { return s.record.states; }),
  };
}

}  // namespace

std::span<const ConfigKey> config_keys() {
  static const std::vector<ConfigKey> keys = [] {
    std::vector<ConfigKey> all = simulator_keys();
    for (const auto& more : {solver_keys(), loop_keys(), file_keys()}) all.insert(all.end(), more.begin(), more.end());
    return all;
  }();
  return keys;
}

void set_action(Settings& settings, const std::string& action, const toml::node& node) {
  std::vector<std::string> keys;
  if (const toml::array* array = node.as_array()) {
    for (const toml::node& element : *array) {
      if (!element.is_string()) throw std::string("must be a key's name or a list of them");
      keys.push_back(element.as_string()->get());
    }
  } else if (node.is_string()) {
    keys.push_back(node.as_string()->get());
  } else {
    throw std::string("must be a key's name or a list of them");
  }
  for (const std::string& key : keys)
    if (key_named(key) == -1) throw "names no key with '" + key + "'" + suggestion(key, key_names());
  settings.actions[action] = keys;
}

std::string quoted_toml(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    const auto code = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (code < 0x20 || code == 0x7f) {
      out += fmt::format("\\u{:04X}", code);
    } else {
      out += c;
    }
  }
  return out + '"';
}

}  // namespace fathom::engine
