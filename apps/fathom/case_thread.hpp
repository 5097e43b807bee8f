// Runs validation cases on a separate thread: Ctrl-C ends the wait for a case that would take minutes.
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "validate/suite.hpp"

namespace fathom::cli {

class CaseThread {
 public:
  /// `tell` is called for each case that ends, and the setup's `say` as usual; never both at once. All must live until
  /// the process ends.
  CaseThread(std::vector<const validate::Case*> list, const validate::Setup& setup,
             std::function<void(const validate::Result&)> tell);

  /// Waits for the end of all cases; false on Ctrl-C. Rethrows what a case throws.
  bool wait();
  /// Results of the cases that have ended.
  std::vector<validate::Result> results() const;
  /// Ends the process instead of a thread that cannot be ended; flushes what was printed.
  [[noreturn]] static void leave(int exit_code);

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace fathom::cli
