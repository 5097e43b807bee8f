// What the application is asked in the middle of a step (`World::set_pre_solve_callback`, `set_filter_callback`). A
// step goes on to its end whatever a callback throws; then it is thrown on.
#pragma once

#include <exception>
#include <fathom/contact.hpp>
#include <functional>

namespace fathom {

class Callbacks {
 public:
  std::function<void(PreSolveContact&)> pre_solve;
  std::function<bool(BodyId a, BodyId b)> filter;

  /// Lets the application change the contact. Where it throws, or changes it to what materials cannot be, the contact
  /// stays as it is.
  void ask(PreSolveContact& contact);
  /// Whether it lets the bodies collide; true where it throws.
  bool lets_collide(BodyId a, BodyId b);

  /// Throws where a callback is running, which wants `action`.
  void check_not_called(const char* action) const;
  /// Throws what was thrown first.
  void rethrow();

 private:
  template <class Call>
  void call(const Call& act);

  bool is_called_ = false;
  std::exception_ptr error_;
};

}  // namespace fathom
