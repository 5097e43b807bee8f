// Callbacks may throw. An exception does not skip the others: all are called, then the first exception is thrown.
#pragma once

#include <exception>
#include <functional>
#include <utility>
#include <vector>

namespace fathom::engine {

class Failures {
 public:
  using Listener = std::function<void(const char* text)>;

  /// False if the call threw.
  template <class Call>
  bool guard(Call&& call) {
    try {
      call();
      return true;
    } catch (...) {
      thrown_.push_back(std::current_exception());
      return false;
    }
  }

  /// Throws the first exception since the last call, after reporting the others.
  void throw_first(const Listener& tell = {}) {
    if (thrown_.empty()) return;
    const std::exception_ptr first = thrown_.front();
    thrown_.erase(thrown_.begin());
    tell_all(tell);
    std::rethrow_exception(first);
  }

  /// Only reports.
  void tell_all(const Listener& tell) {
    for (const std::exception_ptr& thrown : std::exchange(thrown_, {}))
      if (tell) tell_one(thrown, tell);
  }

 private:
  static void tell_one(const std::exception_ptr& thrown, const Listener& tell) {
    try {
      std::rethrow_exception(thrown);
    } catch (const std::exception& error) {
      tell(error.what());
    } catch (...) {
      tell("an exception that is not a std::exception");
    }
  }

  std::vector<std::exception_ptr> thrown_;
};

}  // namespace fathom::engine
