// Calls to the application within a step (`World::set_pre_solve_callback`, `set_filter_callback`). If a callback
// throws, the step is completed first; then the exception is rethrown.
#pragma once

#include <exception>
#include <fathom/contact.hpp>
#include <functional>

namespace fathom {

class Callbacks {
 public:
  std::function<void(PreSolveContact&)> pre_solve;
  std::function<bool(BodyId a, BodyId b)> filter;

  /// Lets the application change the contact. If it throws, or makes the materials invalid, the contact stays
  /// unchanged.
  void ask(PreSolveContact& contact);
  /// Whether it lets the bodies collide; true if it throws.
  bool lets_collide(BodyId a, BodyId b);

  /// Throws if called for `action` from within a callback.
  void check_not_called(const char* action) const;
  /// Rethrows the first exception.
  void rethrow();

 private:
  template <class Call>
  void call(const Call& act);

  bool is_called_ = false;
  std::exception_ptr error_;
};

}  // namespace fathom
