#include "engine/simulation.hpp"

#include <algorithm>
#include <iterator>

#include "engine/trace.hpp"

namespace fathom::engine {
namespace {

std::chrono::steady_clock::duration duration(double seconds) {
  return std::chrono::duration_cast<std::chrono::steady_clock::duration>(std::chrono::duration<double>(seconds));
}

/// Counts the calls of `inspect` in progress; exception-safe.
class Inspection {
 public:
  explicit Inspection(int& count) : count_(++count) {}
  ~Inspection() { --count_; }
  Inspection(const Inspection&) = delete;
  Inspection& operator=(const Inspection&) = delete;

 private:
  int& count_;
};

std::size_t states_to_keep(const SimulationSettings& settings) {
  return settings.mode == SimulationMode::ahead ? static_cast<std::size_t>(settings.ahead) + 2 : 2;
}

}  // namespace

Simulation::Simulation(const WorldDef& def, const SimulationSettings& settings, SimulationObserver* observer)
    : definition_(def), settings_(settings), observer_(observer), world_(def), runner_(world_) {
  if (def.simulator == SimulatorKind::device) device_track_ = world_.hardware();
  if (settings.ahead < 1)
    throw Error(ErrorCode::invalid_argument,
                "simulation: it cannot be " + std::to_string(settings.ahead) + " steps ahead; give at least 1");
  auto empty = take_spare();
  fill(*empty);
  kept_.push_back(std::move(empty));
  thread_ = std::thread([this] { run(); });
}

Simulation::~Simulation() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  work_.notify_all();
  thread_.join();
}

// --- the game's side -----------------------------------------------------------------------------------------

BodyHandle Simulation::make_handle() {
  if (free_handles_.empty()) {
    handle_generations_.push_back(1);
    return {static_cast<std::uint32_t>(handle_generations_.size() - 1), 1};
  }
  const std::uint32_t index = free_handles_.back();
  free_handles_.pop_back();
  return {index, handle_generations_[index]};
}

void Simulation::release_handle(BodyHandle body) {
  ++handle_generations_[body.index];
  free_handles_.push_back(body.index);
}

void Simulation::submit(CommandList&& commands) {
  {
    const std::lock_guard lock(mutex_);
    rethrow();
    const bool async = settings_.mode == SimulationMode::async;
    if (!async || !commands.empty()) orders_[async ? 0 : submitted_ + 1].append(commands);
    if (!async) ++submitted_;
  }
  commands.clear();
  work_.notify_all();
}

void Simulation::submit_at(std::uint64_t step, CommandList&& commands) {
  const std::lock_guard lock(mutex_);
  rethrow();
  const bool async = settings_.mode == SimulationMode::async;
  if (!async && step <= submitted_)
    throw Error(ErrorCode::invalid_argument, "simulation: step " + std::to_string(step) +
                                                 " was submitted already; the next is " +
                                                 std::to_string(submitted_ + 1));
  orders_[step <= begun_ ? 0 : step].append(commands);
  commands.clear();
}

void Simulation::add_script(std::unique_ptr<StepScript> script) {
  const std::lock_guard lock(mutex_);
  rethrow();
  const std::uint64_t last = settings_.mode == SimulationMode::async ? begun_ : submitted_;
  new_scripts_.push_back({std::move(script), last + 1});
}

void Simulation::refuse_to_wait(std::uint64_t step, const std::string& why) const {
  throw Error(ErrorCode::invalid_argument, "simulation: waiting for step " + std::to_string(step) + ", but " + why);
}

bool Simulation::stands_still() const { return settings_.paused || (settings_.paced && settings_.time_scale <= 0); }

void Simulation::wait_for(std::uint64_t step) {
  std::unique_lock lock(mutex_);
  const bool async = settings_.mode == SimulationMode::async;
  const std::uint64_t last = async ? settings_.last_step : submitted_;
  if (step > last) refuse_to_wait(step, "only " + std::to_string(last) + " are to be made");
  if (step > completed_ && inspecting_ > 0) refuse_to_wait(step, "inspect() holds the world; wait after it");
  if (async && stands_still() && step > begun_ + (settings_.paused ? single_steps_ : 0))
    refuse_to_wait(step, "it is paused or its time scale is 0; let it run first");
  done_.wait(lock, [&] { return completed_ >= step || failure_; });
  rethrow();
}

void Simulation::wait_for(std::uint64_t step, double seconds) {
  std::unique_lock lock(mutex_);
  done_.wait_for(lock, duration(seconds), [&] { return completed_ >= step || failure_; });
  rethrow();
}

void Simulation::halt() {
  std::unique_lock lock(mutex_);
  settings_.paused = true;
  single_steps_ = 0;
  const std::uint64_t last = settings_.mode == SimulationMode::async ? begun_ : submitted_;
  done_.wait(lock, [&] { return completed_ >= last || failure_; });
  rethrow();
}

void Simulation::finish() {
  std::uint64_t last = 0;
  {
    const std::lock_guard lock(mutex_);
    last = settings_.mode == SimulationMode::async ? settings_.last_step : submitted_;
  }
  if (last == ~std::uint64_t{0})
    throw Error(ErrorCode::invalid_argument, "simulation: it has no last step to wait for; call set_last_step first");
  wait_for(last);
}

std::uint64_t Simulation::submitted() const {
  const std::lock_guard lock(mutex_);
  return submitted_;
}

std::uint64_t Simulation::completed() const {
  const std::lock_guard lock(mutex_);
  rethrow();
  return completed_;
}

StatePtr Simulation::state(std::uint64_t step) const {
  const std::lock_guard lock(mutex_);
  rethrow();
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return kept->step >= step; });
  return found == kept_.end() ? kept_.back() : *found;
}

StatePtr Simulation::newest() const { return state(~std::uint64_t{0}); }

StatePtr Simulation::previous() const {
  const std::lock_guard lock(mutex_);
  return kept_.size() < 2 ? kept_.back() : kept_[kept_.size() - 2];
}

void Simulation::set_paused(bool paused) {
  {
    const std::lock_guard lock(mutex_);
    settings_.paused = paused;
    single_steps_ = 0;
    next_due_ = Clock::now();
  }
  work_.notify_all();
}

void Simulation::single_steps(int steps) {
  {
    const std::lock_guard lock(mutex_);
    single_steps_ += static_cast<std::uint64_t>(steps);
  }
  work_.notify_all();
}

void Simulation::set_time_scale(double scale) {
  {
    const std::lock_guard lock(mutex_);
    settings_.time_scale = scale;
    next_due_ = Clock::now();
  }
  work_.notify_all();
}

void Simulation::set_last_step(std::uint64_t step) {
  {
    const std::lock_guard lock(mutex_);
    settings_.last_step = step;
    next_due_ = Clock::now();
  }
  work_.notify_all();
}

double Simulation::time_given_up() const {
  const std::lock_guard lock(mutex_);
  return time_given_up_;
}

void Simulation::inspect(const std::function<void(const CommandRunner&)>& look) const {
  const std::lock_guard lock(world_mutex_);
  const Inspection inspection(inspecting_);
  look(runner_);
}

void Simulation::rethrow() const {
  if (failure_) std::rethrow_exception(failure_);
}

// --- the simulation's thread -----------------------------------------------------------------------------------

void Simulation::run() {
  trace::name_thread("simulation");
  const bool async = settings_.mode == SimulationMode::async;
  CommandList commands;
  std::unique_lock lock(mutex_);
  while (async ? wait_until_due(lock) : wait_for_order(lock)) {
    const std::uint64_t step = ++begun_;
    take_orders(step, commands);
    std::move(new_scripts_.begin(), new_scripts_.end(), std::back_inserter(scripts_));
    new_scripts_.clear();
    std::shared_ptr<SimulationState> state = take_spare();
    lock.unlock();
    std::exception_ptr failure;
    try {
      make_step(step, commands, *state);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    if (failure) {
      failure_ = failure;
      done_.notify_all();
      return;
    }
    publish(std::move(state));
  }
}

bool Simulation::wait_for_order(std::unique_lock<std::mutex>& lock) {
  work_.wait(lock, [&] { return stop_ || begun_ < submitted_; });
  return !stop_;
}

bool Simulation::wait_until_due(std::unique_lock<std::mutex>& lock) {
  for (;;) {
    if (stop_) return false;
    if (settings_.paused && single_steps_ > 0 && begun_ < settings_.last_step) {
      --single_steps_;
      return true;
    }
    if (stands_still() || begun_ >= settings_.last_step) {
      work_.wait(lock);
      continue;
    }
    if (!settings_.paced) return true;
    const Clock::time_point now = Clock::now();
    if (now < next_due_) {
      work_.wait_until(lock, next_due_);
      continue;
    }
    const double period = static_cast<double>(definition_.dt) / settings_.time_scale;
    if (now - next_due_ > duration(settings_.catch_up * period)) {
      time_given_up_ += std::chrono::duration<double>(now - next_due_).count() * settings_.time_scale;
      next_due_ = now;
    }
    next_due_ += duration(period);
    return true;
  }
}

void Simulation::take_orders(std::uint64_t step, CommandList& commands) {
  commands.clear();
  for (const std::uint64_t key : {step, std::uint64_t{0}}) {
    const auto found = orders_.find(key);
    if (found == orders_.end()) continue;
    commands.append(found->second);
    orders_.erase(found);
  }
}

void Simulation::make_step(std::uint64_t step, CommandList& commands, SimulationState& state) {
  const std::lock_guard lock(world_mutex_);
  {
    const trace::Zone zone("commands");
    for (const Script& script : scripts_)
      if (step >= script.first_step) script.script->before_step(step, runner_, commands);
    if (observer_) observer_->before_step(step, commands, runner_);
    runner_.run(commands);
  }
  Clock::time_point start;
  {
    const trace::Zone zone("step");
    start = Clock::now();  // within the zone, which must contain the stages
    world_.step();
    world_.wait();     // with `WorldDef::ahead`: the state must be that of this step
    world_.profile();  // the device simulator returns before the step is done; reading waits for it
  }
  state.step_ms = std::chrono::duration<double, std::milli>(Clock::now() - start).count();
  trace::add_step(world_.profile().times, start, device_track_);
  const trace::Zone zone("publish");
  if (observer_) observer_->after_step(world_);
  fill(state);
}

void Simulation::fill(SimulationState& state) const {
  const std::vector<CommandRunner::Entry>& entries = runner_.entries();
  state.step = world_.step_count();
  state.time = world_.time();
  state.poses.resize(entries.size());
  state.velocities.resize(entries.size());
  state.generations.resize(entries.size());
  const std::span<const Pose> poses = world_.poses();
  const std::span<const Velocity> velocities = world_.velocities();
  for (std::size_t i = 0; i < entries.size(); ++i) {
    state.generations[i] = entries[i].generation;
    if (entries[i].generation == 0) continue;
    state.poses[i] = poses[entries[i].body.index];
    state.velocities[i] = velocities[entries[i].body.index];
  }
  const auto touch = [&](const ContactEvent& e) { return TouchEvent{runner_.handle(e.a), runner_.handle(e.b)}; };
  state.begun.clear();
  state.ended.clear();
  state.hits.clear();
  state.breaks.clear();
  state.sensor_begun.clear();
  state.sensor_ended.clear();
  for (const ContactEvent& event : world_.contacts_begun()) state.begun.push_back(touch(event));
  for (const ContactEvent& event : world_.contacts_ended()) state.ended.push_back(touch(event));
  for (const HitEvent& e : world_.hits())
    state.hits.push_back({runner_.handle(e.a), runner_.handle(e.b), e.point, e.normal, e.approach_speed});
  for (const JointBreak& b : world_.joints_broken())
    state.breaks.push_back({runner_.handle(b.a), runner_.handle(b.b), b.force, b.torque, b.user_data});
  const auto presence = [&](const SensorEvent& e) {
    return PresenceEvent{runner_.handle(e.sensor), runner_.handle(e.body)};
  };
  for (const SensorEvent& event : world_.sensor_begun()) state.sensor_begun.push_back(presence(event));
  for (const SensorEvent& event : world_.sensor_ended()) state.sensor_ended.push_back(presence(event));
  state.profile = world_.profile();
  state.hash = settings_.hashes ? world_.state_hash() : 0;
  state.published = Clock::now();
}

std::shared_ptr<SimulationState> Simulation::take_spare() {
  std::unique_ptr<SimulationState> state;
  {
    const std::lock_guard lock(pool_->mutex);
    if (!pool_->spares.empty()) {
      state = std::move(pool_->spares.back());
      pool_->spares.pop_back();
    }
  }
  if (!state) state = std::make_unique<SimulationState>();
  // The last reader returns it.
  return {state.release(), [pool = pool_](SimulationState* used) {
            std::unique_ptr<SimulationState> spare(used);
            const std::lock_guard lock(pool->mutex);
            pool->spares.push_back(std::move(spare));
          }};
}

void Simulation::publish(std::shared_ptr<SimulationState> state) {
  completed_ = state->step;
  kept_.push_back(std::move(state));
  while (kept_.size() > states_to_keep(settings_)) kept_.pop_front();
  done_.notify_all();
}

}  // namespace fathom::engine
