#include "engine/engine.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <thread>

#include "engine/recording.hpp"
#include "engine/simulator_choice.hpp"
#include "engine/trace.hpp"
#include "files/file_names.hpp"

namespace fathom::engine {
namespace {

constexpr double speed_window = 1.0;                         // s over which FrameStats::speed is measured
constexpr double rounding = 1e-6;                            // error of sums of steps, relative to a step
constexpr auto longest_nap = std::chrono::milliseconds(20);  // interval at which a waiting frame checks whether to end

/// The intended value of a single-precision time step, so that ten steps of 0.01 s are 0.1 s: a unit fraction of a
/// second, even if written with a digit too few (0.0083333333), otherwise the shortest decimal number.
double nominal(float dt) {
  const double part = 1 / std::round(1 / static_cast<double>(dt));
  const auto rounded = static_cast<float>(part);
  const bool meant = dt >= std::nextafter(rounded, 0.0f) && dt <= std::nextafter(rounded, 1.0f);
  return meant ? part : std::stod(fmt::format("{}", dt));
}

double seconds(std::chrono::steady_clock::duration duration) { return std::chrono::duration<double>(duration).count(); }

LogSettings log_settings(const Settings& s) {
  return {log_level_named(s.log.level), s.log.console, s.log.file, s.log.file_size, s.log.files};
}

/// The configuration, if no two of its files are the same.
Config checked(Config config) {
  files::FileNames names;
  names.writes("record.file", config->record.file);
  names.writes("trace.file", config->trace.file);
  names.writes("log.data", config->log.data);
  names.writes("log.file", config->log.file);
  return config;
}

SimulationSettings simulation_settings(const Settings& s) {
  SimulationSettings out;
  out.mode = s.simulator.mode;
  out.ahead = s.simulator.ahead;
  out.hashes = s.simulator.hashes;
  out.paced = s.loop.time == TimeSource::wall;
  out.time_scale = s.loop.time_scale;
  out.paused = true;  // until the first frame has submitted the initial commands
  out.catch_up = s.loop.max_steps_per_frame;
  return out;
}

}  // namespace

Engine::Engine(Config config, FrontEnd* front_end)
    : config_(checked(std::move(config))),
      log_(log_settings(*config_)),
      data_(config_->log.data),
      front_end_(front_end ? *front_end : headless_),
      world_(*this, static_cast<std::uint32_t>(config_->world.spawns_per_frame)),
      paused_(config_->loop.paused),
      time_scale_(config_->loop.time_scale) {
  for (const auto& [action, keys] : config_->actions)
    for (const std::string& key : keys) input_.bind(action, key);
  input_.add_handler(std::numeric_limits<int>::min(), [this](const InputEvent& event) {
    if (event.kind == InputKind::window_closed) stop();
    return event.kind == InputKind::window_closed;
  });
  if (!config_->record.file.empty())
    recorder_ = std::make_unique<Recorder>(config_->record.file,
                                           RecordSettings{config_->record.snapshot_every, config_->record.states});
  choose_simulator(config_, log_);
  const WorldDef def = config_.world_definition([this](std::string_view line) { log_.write(LogLevel::warning, line); });
  simulation_ = std::make_unique<Simulation>(def, simulation_settings(*config_), recorder_.get());
  world_.set_state(simulation_->newest());
  if (!config_->trace.file.empty()) trace_ = std::make_unique<trace::Session>(config_->trace.file);
  trace::name_thread("engine");
  started_ = frame_start_ = next_frame_ = speed_since_ = Clock::now();
}

Engine::~Engine() {
  try {
    finish();
  } catch (const std::exception& error) {
    // If the run is already ending with an error, that error is reported instead.
    if (std::uncaught_exceptions() == 0) log_.error("{}", error.what());
  }
}

void Engine::finish() {
  refuse_in_callback("finish");
  simulation_runs_ = false;
  simulation_.reset();
  if (const std::unique_ptr<Recorder> recorder = std::move(recorder_)) {
    recorder->finish();
    log_.info("recorded {} steps to {}", recorder->steps(), config_->record.file);
  }
  if (const std::unique_ptr<trace::Session> session = std::move(trace_)) {
    session->finish();
    if (session->lost_count() > 0) log_.warning("{} zones were lost: the trace is full", session->lost_count());
  }
  data_.flush();
  log_.flush();
}

double Engine::time() const { return static_cast<double>(step_) * static_cast<double>(config_->simulator.dt); }

double Engine::timer_time() const { return static_cast<double>(step_) * nominal(config_->simulator.dt); }

bool Engine::is_async() const { return config_->simulator.mode == SimulationMode::async; }

void Engine::check_call(const char* what) const {
  if (!simulation_)
    throw Error(ErrorCode::invalid_argument, fmt::format("{}: the engine was finished; make another one", what));
  refuse_in_callback(what);
}

void Engine::refuse_in_callback(const char* what) const {
  if (in_frame_)
    throw Error(ErrorCode::invalid_argument,
                fmt::format("{}: it was called from a callback; call stop(), and this after run() has returned", what));
}

// Async: the simulation starts only after a frame has submitted the initial commands.
void Engine::set_paused(bool paused) {
  paused_ = paused;
  if (simulation_runs_) simulation_->set_paused(paused);
}

void Engine::set_time_scale(double scale) {
  if (!std::isfinite(scale) || scale < 0)
    throw Error(ErrorCode::invalid_argument,
                "set time scale: " + std::to_string(scale) + "; it must be finite and at least 0");
  time_scale_ = scale;
  if (is_async()) simulation_->set_time_scale(scale);
}

// --- the loop ------------------------------------------------------------------------------------------------------

void Engine::run(std::uint64_t steps) {
  check_call("run");
  if (simulation_runs_) settle();
  stopping_ = false;
  last_step_ = steps == 0 ? ~std::uint64_t{0} : step_ + steps;
  frame_start_ = next_frame_ = speed_since_ = Clock::now();
  if (is_async()) simulation_->set_last_step(last_step_);
  try {
    while (!ends() && step_ < last_step_) guarded_frame();
    failures_.throw_first();  // exceptions of `end_when` between two frames
  } catch (...) {
    try {
      settle();
    } catch (const Error&) {
      // The simulation has failed; that error is being thrown already.
    }
    throw;
  }
  settle();
}

bool Engine::ends() {
  if (!ended_) return stopping_;
  const bool in_frame = std::exchange(in_frame_, true);
  bool ended = true;  // also if it throws
  if (failures_.guard([&] { ended = ended_(); }) && ended) stopping_ = true;
  in_frame_ = in_frame;
  return stopping_ || ended;
}

// On return no step is in progress, and the game has the newest state.
void Engine::settle() {
  last_step_ = ~std::uint64_t{0};
  stopping_ = simulation_runs_ = false;
  simulation_->halt();
  if (is_async()) simulation_->set_last_step(last_step_);
  world_.set_state(simulation_->newest());
  if (is_async()) step_ = world_.state()->step;
}

void Engine::frame() {
  check_call("frame");
  stopping_ = false;  // ends only runs
  guarded_frame();
}

void Engine::guarded_frame() {
  const auto log = [this](const char* text) { log_.error("frame {}: {}", stats_.frame, text); };
  in_frame_ = true;
  try {
    make_frame();
  } catch (...) {
    in_frame_ = false;
    failures_.tell_all(log);
    throw;
  }
  in_frame_ = false;
  failures_.throw_first(log);
}

void Engine::make_frame() {
  const trace::Zone zone("frame");
  const Clock::time_point now = Clock::now();
  stats_.frame_ms = 1e3 * seconds(now - frame_start_);
  frame_start_ = now;
  ++stats_.frame;
  stats_.steps = 0;
  stats_.tick_ms = 0;
  take_events();
  for (std::size_t i = 0; i < on_frame_.size(); ++i) failures_.guard([&] { on_frame_[i](*this); });
  {
    const trace::Zone timers("timers");
    timers_.advance(TimeBase::wall, seconds(now - started_), 0, failures_);
  }
  change_entities();
  if (is_async())
    follow();
  else
    for (int due = steps_due(); due > 0 && !ends() && step_ < last_step_; --due) make_step();
  draw();
  measure();
  pace();
}

void Engine::take_events() {
  const trace::Zone zone("events");
  events_.clear();
  failures_.guard([&] { front_end_.poll(events_); });
  events_.insert(events_.end(), injected_.begin(), injected_.end());
  injected_.clear();
  input_.dispatch(events_, failures_);
}

void Engine::change_entities() {
  const trace::Zone zone("entities");
  // Entities requested before the first frame exist from the first step, regardless of the limit.
  const std::uint32_t limit = stats_.frame == 1 ? ~0u : world_.spawn_limit();
  stats_.spawned = world_.take_over_changes(limit, failures_);
  stats_.waiting = world_.waiting();
  const bool holding_back = stats_.waiting > 0;
  if (holding_back && !holding_back_)
    log_.warning("frame {}: {} entities wait to be spawned; world.spawns_per_frame is {}", stats_.frame, stats_.waiting,
                 world_.spawn_limit());
  if (!holding_back && holding_back_) log_.info("frame {}: no more entities wait to be spawned", stats_.frame);
  holding_back_ = holding_back;
}

int Engine::steps_due() {
  if (paused_) return std::exchange(single_steps_, 0);
  single_steps_ = 0;
  if (config_->loop.time == TimeSource::steps) return 1;
  const auto dt = static_cast<double>(config_->simulator.dt);
  owed_ += 1e-3 * stats_.frame_ms * time_scale_;
  const double due = std::floor(owed_ / dt);
  owed_ -= due * dt;
  const double most = config_->loop.max_steps_per_frame;
  if (due > most) stats_.time_given_up += (due - most) * dt;
  return static_cast<int>(std::min(due, most));
}

void Engine::make_step() {
  ++step_;
  ++stats_.steps;
  {
    const trace::Zone zone("timers");
    timers_.advance(TimeBase::simulated, timer_time(), rounding * nominal(config_->simulator.dt), failures_);
  }
  tick(TickPhase::before);
  simulation_->submit(std::move(world_.commands()));
  tick(TickPhase::during);
  const auto ahead =
      config_->simulator.mode == SimulationMode::ahead ? static_cast<std::uint64_t>(config_->simulator.ahead) : 0;
  if (step_ > ahead) {
    const trace::Zone zone("wait for simulation");
    simulation_->wait_for(step_ - ahead);
    world_.set_state(simulation_->state(step_ - ahead));
  }
  tick(TickPhase::after);
}

// Async: the simulation steps by itself; a frame reads the newest state.
void Engine::follow() {
  const std::uint64_t before = step_;
  tick(TickPhase::before);
  simulation_->submit(std::move(world_.commands()));
  if (!simulation_runs_) simulation_->set_paused(paused_);
  simulation_runs_ = true;
  const int single_steps = std::exchange(single_steps_, 0);
  if (paused_ && single_steps > 0) simulation_->single_steps(single_steps);
  tick(TickPhase::during);
  // Unpaced frames would keep reading the same state.
  if (config_->loop.pacing == Pacing::free) simulation_->wait_for(before + 1, 1 / config_->loop.rate);
  world_.set_state(simulation_->newest());
  step_ = world_.state()->step;
  stats_.steps = static_cast<int>(step_ - before);
  stats_.time_given_up = simulation_->time_given_up();
  timers_.advance(TimeBase::simulated, timer_time(), rounding * nominal(config_->simulator.dt), failures_);
  tick(TickPhase::after);
}

void Engine::tick(TickPhase phase) {
  constexpr const char* names[] = {"", "ticks before", "ticks during", "ticks after"};
  const trace::Zone zone(names[static_cast<int>(phase)]);
  const Clock::time_point start = Clock::now();
  const std::uint64_t step = is_async() ? step_ + (phase == TickPhase::after ? 0 : 1) : step_;
  const auto dt = config_->simulator.dt;
  world_.run_ticks({*this, phase, step, static_cast<double>(step) * static_cast<double>(dt), dt}, failures_);
  stats_.tick_ms += 1e3 * seconds(Clock::now() - start);
}

void Engine::draw() {
  if (&front_end_ == &headless_) return;
  const trace::Zone zone("render");
  const StatePtr newest = is_async() ? simulation_->newest() : nullptr;
  const SimulationState& to = newest ? *newest : *world_.state();
  const StatePtr previous = is_async() ? simulation_->previous() : nullptr;
  // One step behind, to interpolate between two known states.
  const double since = seconds(Clock::now() - to.published) * time_scale_ / static_cast<double>(config_->simulator.dt);
  const float share = previous ? static_cast<float>(std::clamp(since, 0.0, 1.0)) : 1.0f;
  DrawFrame frame;
  world_.describe(frame, previous ? *previous : to, to, share);
  frame.camera = camera_;
  frame.frame = stats_.frame;
  frame.step = to.step;
  frame.time = to.time;
  frame.frame_seconds = 1e-3 * stats_.frame_ms;
  frame.speed = stats_.speed;
  frame.paused = paused_;
  frame.profile = to.step > 0 ? &to.profile : nullptr;
  failures_.guard([&] { front_end_.draw(frame); });
}

void Engine::pace() {
  const Pacing pacing = config_->loop.pacing;
  if (pacing == Pacing::free || (pacing == Pacing::vsync && front_end_.has_vsync())) return;
  const trace::Zone zone("pace");
  const auto period =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / config_->loop.rate));
  next_frame_ = std::max(next_frame_ + period, Clock::now() - period);
  while (Clock::now() < next_frame_ && !ends())
    std::this_thread::sleep_until(std::min<Clock::time_point>(next_frame_, Clock::now() + longest_nap));
}

void Engine::measure() {
  const Clock::time_point now = Clock::now();
  const SimulationState& state = *world_.state();
  if (const double span = seconds(now - speed_since_); span >= speed_window) {
    stats_.speed = (state.time - speed_time_) / span;
    speed_since_ = now;
    speed_time_ = state.time;
    const bool slow = stats_.time_given_up > reported_given_up_;
    if (slow && !slow_)
      log_.warning("the machine is too slow: simulated time runs at {:.2f} of {:.2f}", stats_.speed, time_scale_);
    if (!slow && slow_)
      log_.info("the machine keeps up again; {:.2f} s of simulated time were given up", stats_.time_given_up);
    slow_ = slow;
    reported_given_up_ = stats_.time_given_up;
  }
  trace::count("entities", world_.count());
  if (!data_.is_open()) return;
  data_.set_now(stats_.frame, state.step, state.time);
  data_.add("frame_ms", stats_.frame_ms);
  data_.add("tick_ms", stats_.tick_ms);
  data_.add("steps", stats_.steps);
  data_.add("step_ms", state.step_ms);
  data_.add("entities", world_.count());
  data_.add("waiting", static_cast<double>(stats_.waiting));
  data_.add("speed", stats_.speed);
}

}  // namespace fathom::engine
