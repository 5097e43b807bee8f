// Cases of the validation on a thread of their own: Ctrl-C ends the wait for one that would take minutes.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "validate/suite.hpp"

namespace fathom::cli {

class CaseThread {
 public:
  /// `tell` hears of each case that ended, and what the setup's `say` is told; never both at once. All must live until
  /// the process ends.
  CaseThread(std::vector<const validate::Case*> list, const validate::Setup& setup,
             std::function<void(const validate::Result&)> tell);

  /// Waits for the end of all cases, or for Ctrl-C: false. What a case throws is thrown here.
  bool wait();
  /// Those of cases that ended.
  std::vector<validate::Result> results() const;
  /// Ends the process in place of a thread that cannot be ended; what was printed is flushed.
  [[noreturn]] static void leave(int exit_code);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace fathom::cli
