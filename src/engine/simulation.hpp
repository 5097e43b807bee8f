// A simulator as a subsystem on its own thread. The game submits commands and receives states; it never accesses the
// world itself.
//
// * lockstep: the game submits a step, does other work meanwhile, and waits for its state.
// * ahead N: the same, but the game waits only for the state of N steps earlier, and draws that.
// * async: the simulation steps by itself, at the rate of wall time times the time scale; commands act before the next
//   step that begins. If the machine is too slow, simulated time falls behind; it catches up by at most a few steps,
//   and `slowdown` reports the loss.
//
// The commands that act before a step, and the step's number, determine its result. The modes differ only in when the
// game sees it.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <fathom/world.hpp>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "engine/command_runner.hpp"

namespace fathom::engine {

enum class SimulationMode : std::uint8_t { lockstep, ahead, async };

/// `ContactEvent` and `HitEvent` of the world, by handle.
struct TouchEvent {
  BodyHandle a, b;
};
struct ImpactEvent {
  BodyHandle a, b;
  Vec3 point;            ///< m, world
  Vec3 normal;           ///< unit, from a to b
  float approach_speed;  ///< m/s
};
/// `JointBreak` of the world, by handle.
struct BreakEvent {
  BodyHandle a, b;
  Vec3 force, torque;           ///< N and N·m, on B
  std::uint64_t user_data = 0;  ///< of the joint
};

/// `SensorEvent` of the world, by handle.
struct PresenceEvent {
  BodyHandle sensor, body;
};

/// The world after a step, as the game sees it. Arrays are indexed by `BodyHandle::index`.
struct SimulationState {
  std::uint64_t step = 0;
  double time = 0;  ///< s simulated
  std::vector<Pose> poses;
  std::vector<Velocity> velocities;
  std::vector<std::uint32_t> generations;  ///< of the body in the entry; 0 for none
  std::vector<TouchEvent> begun, ended;
  std::vector<ImpactEvent> hits;
  std::vector<BreakEvent> breaks;
  std::vector<PresenceEvent> sensor_begun, sensor_ended;
  Profile profile;
  double step_ms = 0;      ///< wall time of the step
  std::uint64_t hash = 0;  ///< `World::state_hash`, if requested
  std::chrono::steady_clock::time_point published;

  bool contains(BodyHandle body) const {
    return body.index < generations.size() && generations[body.index] == body.generation && body.generation != 0;
  }
};
using StatePtr = std::shared_ptr<const SimulationState>;

/// Notified of everything that happens to the world, on the simulation's thread (see recording.hpp).
class SimulationObserver {
 public:
  virtual ~SimulationObserver() = default;
  /// Called before the step's commands are executed; the runner's world has taken `step − 1` steps.
  virtual void before_step(std::uint64_t step, const CommandList& commands, const CommandRunner& runner) = 0;
  virtual void after_step(const World& world) = 0;
};

/// Actions tied to steps, independent of threads and frames.
class StepScript {
 public:
  virtual ~StepScript() = default;
  /// Adds to the commands of a step, on the simulation's thread. The list already contains the game's commands for this
  /// step; none has been executed yet.
  virtual void before_step(std::uint64_t step, const CommandRunner& runner, CommandList& commands) = 0;
};

struct SimulationSettings {
  SimulationMode mode = SimulationMode::lockstep;
  int ahead = 1;                                ///< N of `ahead`, ≥ 1
  bool hashes = false;                          ///< fill `SimulationState::hash`
  bool paced = true;                            ///< async: keep to wall time; false runs as fast as possible
  double time_scale = 1;                        ///< async, ≥ 0
  bool paused = false;                          ///< async
  std::uint64_t last_step = ~std::uint64_t{0};  ///< async: last step to take
  int catch_up = 4;                             ///< async: maximum steps in a row before time is given up
};

class Simulation {
 public:
  /// Throws what `World` throws for a definition out of range.
  Simulation(const WorldDef& def, const SimulationSettings& settings, SimulationObserver* observer = nullptr);
  ~Simulation();
  Simulation(const Simulation&) = delete;
  Simulation& operator=(const Simulation&) = delete;

  // For the game's thread. The next of these calls throws an error of the simulation's thread.
  BodyHandle make_handle();
  void release_handle(BodyHandle body);

  /// Lockstep and ahead: submits the next step with the commands before it. Async: commands act before the next step
  /// that begins.
  void submit(CommandList&& commands);
  /// The same, but before step `step` (from 1), which must not have been submitted (async: if it has begun, the
  /// commands act before the next). Several lists for a step act in the order of submission.
  void submit_at(std::uint64_t step, CommandList&& commands);
  /// Calls the script before every step submitted (async: begun) from here on.
  void add_script(std::unique_ptr<StepScript> script);
  /// Waits until the step has been published. Refuses to wait for a step that will never come: one that was not
  /// submitted; async: one beyond `last_step`, or a future one while paused or at time scale 0.
  void wait_for(std::uint64_t step);
  /// The same for at most this long (s).
  void wait_for(std::uint64_t step, double seconds);
  /// Waits until all submitted steps have been published; async: until `last_step` has.
  void finish();
  /// Waits until no step is in progress: all submitted steps have been published; async: also pauses.
  void halt();

  std::uint64_t submitted() const;
  std::uint64_t completed() const;
  /// The state after a step, or the oldest one kept; the newest `ahead` + 2 are kept. Step 0 is the empty world.
  StatePtr state(std::uint64_t step) const;
  StatePtr newest() const;
  /// The state before the newest.
  StatePtr previous() const;

  void set_paused(bool paused);            ///< async
  void single_steps(int steps);            ///< async: steps to take while paused
  void set_time_scale(double scale);       ///< async
  void set_last_step(std::uint64_t step);  ///< async
  /// s of wall time given up so far because steps took too long (async).
  double time_given_up() const;

  /// Calls `look` with the world between two steps: for queries, not for waiting. `CommandRunner::body` finds a
  /// handle's body.
  void inspect(const std::function<void(const CommandRunner&)>& look) const;

  const WorldDef& definition() const { return definition_; }
  const SimulationSettings& settings() const { return settings_; }

 private:
  using Clock = std::chrono::steady_clock;

  void run();
  bool wait_for_order(std::unique_lock<std::mutex>& lock);
  bool wait_until_due(std::unique_lock<std::mutex>& lock);
  void take_orders(std::uint64_t step, CommandList& commands);
  void make_step(std::uint64_t step, CommandList& commands, SimulationState& state);
  void fill(SimulationState& state) const;
  std::shared_ptr<SimulationState> take_spare();
  void publish(std::shared_ptr<SimulationState> state);
  void rethrow() const;
  void refuse_to_wait(std::uint64_t step, const std::string& why) const;
  bool stands_still() const;

  struct Script {
    std::unique_ptr<StepScript> script;
    std::uint64_t first_step = 0;
  };
  /// States for reuse, to avoid allocation in steps.
  struct Pool {
    std::mutex mutex;
    std::vector<std::unique_ptr<SimulationState>> spares;
  };

  WorldDef definition_;
  SimulationSettings settings_;
  SimulationObserver* observer_;

  mutable std::recursive_mutex world_mutex_;  // held while the world changes, and by `inspect`, which may nest
  World world_;
  std::string device_track_;  // where the trace shows the stages; empty: within the step
  CommandRunner runner_;
  std::vector<Script> scripts_;  // used by the simulation's thread

  const std::shared_ptr<Pool> pool_ = std::make_shared<Pool>();
  mutable std::mutex mutex_;
  std::condition_variable work_, done_;
  std::map<std::uint64_t, CommandList> orders_;  // by step; 0: before the next that begins
  std::vector<Script> new_scripts_;
  std::deque<std::shared_ptr<SimulationState>> kept_;  // oldest first
  std::uint64_t submitted_ = 0, begun_ = 0, completed_ = 0;
  std::uint64_t single_steps_ = 0;
  Clock::time_point next_due_{};
  double time_given_up_ = 0;
  std::exception_ptr failure_;
  bool stop_ = false;

  // The game's thread only.
  mutable int inspecting_ = 0;
  std::vector<std::uint32_t> handle_generations_;
  std::vector<std::uint32_t> free_handles_;

  std::thread thread_;
};

}  // namespace fathom::engine
