#include "case_thread.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>

#include "measure/system.hpp"

namespace fathom::cli {
namespace {

constexpr std::chrono::milliseconds look_interval{50};  // for checking Ctrl-C

}  // namespace

struct CaseThread::State {
  std::vector<const validate::Case*> list;
  validate::Setup setup;
  std::function<void(const validate::Result&)> tell;

  std::mutex mutex;
  std::condition_variable changed;
  std::vector<validate::Result> results;
  std::exception_ptr failure;
  bool is_done = false, is_left = false;

  void run() {
    for (const validate::Case* test : list) {
      validate::Result result = validate::run_case(*test, setup);
      const std::lock_guard lock(mutex);
      if (is_left) return;
      tell(result);
      results.push_back(std::move(result));
    }
  }
};

CaseThread::CaseThread(std::vector<const validate::Case*> list, const validate::Setup& setup,
                       std::function<void(const validate::Result&)> tell)
    : state_(std::make_shared<State>()) {
  State& state = *state_;
  state.list = std::move(list);
  state.setup = setup;
  state.tell = std::move(tell);
  if (setup.say) {
    state.setup.say = [&state, say = setup.say](const std::string& line) {
      const std::lock_guard lock(state.mutex);
      if (!state.is_left) say(line);
    };
  }
  std::thread([shared = state_] {
    std::exception_ptr failure;
    try {
      shared->run();
    } catch (...) {
      failure = std::current_exception();
    }
    const std::lock_guard lock(shared->mutex);
    shared->failure = failure;
    shared->is_done = true;
    shared->changed.notify_all();
  }).detach();
}

bool CaseThread::wait() {
  std::unique_lock lock(state_->mutex);
  while (!state_->is_done && !InterruptGuard::requested()) state_->changed.wait_for(lock, look_interval);
  state_->is_left = !state_->is_done;
  if (state_->failure) std::rethrow_exception(state_->failure);
  return state_->is_done;
}

std::vector<validate::Result> CaseThread::results() const {
  const std::lock_guard lock(state_->mutex);
  return state_->results;
}

void CaseThread::leave(int exit_code) {
  std::fflush(stdout);
  std::_Exit(exit_code);
}

}  // namespace fathom::cli
