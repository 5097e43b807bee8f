// The engine: one class that runs the main loop around a world of entities and a simulator on its own thread
// (dissertation, section 3.1 and figure 3.1).
//
// A frame is
//     window and input events → timers → spawns and destructions
//     → for every step of the frame: ticks before → simulation ∥ ticks during → ticks after
//     → render
// A frame takes zero or more steps of fixed length: as many as wall time requires (`loop.time = "wall"`) or one
// (`loop.time = "steps"`). Ticks belong to steps, so logic does not depend on the frame rate.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>

#include "engine/config.hpp"
#include "engine/data_log.hpp"
#include "engine/entity_world.hpp"
#include "engine/failures.hpp"
#include "engine/front_end.hpp"
#include "engine/input.hpp"
#include "engine/log.hpp"
#include "engine/simulation.hpp"
#include "engine/timers.hpp"

namespace fathom::engine {

class Recorder;
namespace trace {
class Session;
}

/// Statistics of the last frame.
struct FrameStats {
  std::uint64_t frame = 0;  ///< from 1
  double frame_ms = 0;      ///< wall time from start to start
  double tick_ms = 0;       ///< wall time of all ticks
  int steps = 0;            ///< steps begun
  std::uint32_t spawned = 0;
  std::size_t waiting = 0;   ///< entities held back by the spawn limit
  double speed = 1;          ///< simulated seconds per second of wall time, over the last second
  double time_given_up = 0;  ///< s of simulated time skipped so far because the machine was too slow
};

class Engine {
 public:
  /// Throws `Error` for a configuration out of range. `front_end` must outlive the engine; null is headless.
  explicit Engine(Config config = {}, FrontEnd* front_end = nullptr);
  ~Engine();
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  /// Runs frames until `stop`, the window closes, `end_when`, or `steps` more steps (0: no end). No step is in progress
  /// when it returns or throws. An exception of a callback is thrown after the frame is complete, so it skips no other
  /// callback; further ones are logged. Another `run` continues from there. Also throws errors of the simulation's
  /// thread; those end the simulation.
  void run(std::uint64_t steps = 0);
  /// Stops the simulation and completes recording, trace and data files; afterwards the engine cannot be used. Throws
  /// `Error{file}` if a file could not be written. The destructor does the same and logs errors.
  void finish();
  /// Runs one frame. Throws like `run`. Neither may be called from a callback.
  void frame();
  /// Ends `run` after this frame.
  void stop() { stopping_ = true; }
  /// Ends `run` as soon as it returns true; called between steps and while a frame waits: for signals.
  void end_when(std::function<bool()> ended) { ended_ = std::move(ended); }

  void set_paused(bool paused);
  bool paused() const { return paused_; }
  /// Takes one step while paused. In mode `async` its result appears in one of the next frames.
  void single_step() { ++single_steps_; }
  /// Simulated seconds per second of wall time, ≥ 0. Throws `Error{invalid_argument}` on anything else.
  void set_time_scale(double scale);
  double time_scale() const { return time_scale_; }

  EntityWorld& world() { return world_; }
  Simulation& simulation() { return *simulation_; }
  Timers& timers() { return timers_; }
  Input& input() { return input_; }
  Log& log() { return log_; }
  DataLog& data() { return data_; }
  Camera& camera() { return camera_; }
  const Config& config() const { return config_; }
  const FrameStats& stats() const { return stats_; }
  std::uint64_t steps() const { return step_; }  ///< steps begun by the game
  double time() const;                           ///< s simulated at the end of the last of them

  /// Called once per frame, after events and before timers: for anything tied to the frame rate, such as cameras.
  void on_frame(std::function<void(Engine&)> callback) { on_frame_.push_back(std::move(callback)); }
  /// Events for the next frame, as if they came from the front end.
  void inject(const InputEvent& event) { injected_.push_back(event); }

 private:
  using Clock = std::chrono::steady_clock;

  bool is_async() const;
  bool ends();
  void settle();
  void guarded_frame();
  void make_frame();
  void check_call(const char* what) const;
  void refuse_in_callback(const char* what) const;
  double timer_time() const;
  void take_events();
  void change_entities();
  int steps_due();
  void make_step();
  void follow();
  void tick(TickPhase phase);
  void draw();
  void measure();
  void pace();

  Config config_;
  Log log_;
  DataLog data_;
  HeadlessFrontEnd headless_;
  FrontEnd& front_end_;
  Input input_;
  Timers timers_;
  std::unique_ptr<Recorder> recorder_;
  std::unique_ptr<trace::Session> trace_;
  EntityWorld world_;
  std::unique_ptr<Simulation> simulation_;
  Camera camera_;
  std::deque<std::function<void(Engine&)>> on_frame_;  // a deque: callbacks may add others
  std::function<bool()> ended_;
  Failures failures_;
  std::vector<InputEvent> events_, injected_;
  FrameStats stats_;
  std::uint64_t step_ = 0;
  std::uint64_t last_step_ = ~std::uint64_t{0};
  int single_steps_ = 0;
  bool paused_ = false;
  bool stopping_ = false;
  double time_scale_ = 1;
  double owed_ = 0;  // s of simulated time due
  Clock::time_point started_, frame_start_, next_frame_, speed_since_;
  double speed_time_ = 0;
  double reported_given_up_ = 0;
  bool simulation_runs_ = false;  // async: has been started
  bool in_frame_ = false;
  bool holding_back_ = false, slow_ = false;
};

}  // namespace fathom::engine
