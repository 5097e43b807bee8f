// Routes keyboard, mouse and window events from a front end to their handlers.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/failures.hpp"

namespace fathom::engine {

enum class InputKind : std::uint8_t {
  key_pressed,
  key_released,
  key_repeated,
  mouse_pressed,
  mouse_released,
  mouse_moved,     ///< x, y: position in pixels from the window's upper left corner
  mouse_scrolled,  ///< x, y: notches
  window_resized,  ///< x, y: size of the drawable area in pixels
  window_focused,
  window_unfocused,
  window_closed,
};

enum Modifier : std::uint8_t { shift = 1, control = 2, alt = 4, super = 8 };

/// One event. `code` is a key of `key_named` (GLFW's numbering: 'A' is 65, escape 256) or a mouse button (0 left,
/// 1 right, 2 middle).
struct InputEvent {
  InputKind kind = InputKind::key_pressed;
  std::uint8_t modifiers = 0;  ///< of `Modifier`
  std::uint16_t code = 0;
  float x = 0, y = 0;

  friend bool operator==(const InputEvent&, const InputEvent&) = default;
};

/// Code of a key by its name ("a", "7", "space", "escape", "left", "f5", "mouse_left"), or −1 for an unknown name.
/// Mouse buttons have negative codes below −1: −2 − button.
int key_named(std::string_view name);
/// The name that `key_named` gives that code, or "key <code>".
std::string name_of_key(int code);
/// Every name that `key_named` knows.
std::span<const std::string_view> key_names();

/// Routes events to handlers, highest priority first, until one consumes them; turns bound keys into actions.
class Input {
 public:
  using HandlerId = std::uint32_t;
  /// Returns true to consume the event: handlers of lower priority do not see it.
  using Handler = std::function<bool(const InputEvent&)>;
  /// Called whenever a key bound to the action goes down (true), and when the last of them goes up (false). A handler
  /// that saw a press also sees the release, consumed or not.
  using ActionHandler = std::function<void(bool pressed)>;

  /// The priority of actions among handlers.
  static constexpr int action_priority = 0;

  /// Handlers of equal priority are called in the order they were added. May be called from a handler.
  HandlerId add_handler(int priority, Handler handler);
  void remove_handler(HandlerId id);

  /// Binds a key to an action; an action may have several keys, a key several actions. Throws
  /// `Error{invalid_argument}` for an unknown key name, suggesting the nearest.
  void bind(std::string_view action, std::string_view key);
  HandlerId on_action(std::string_view action, ActionHandler handler);
  /// True while any key bound to the action is down.
  bool held(std::string_view action) const;

  /// Routes the events to the handlers. An exception of a handler goes to `failures`, or is thrown after all events;
  /// the event then counts as not consumed.
  void dispatch(std::span<const InputEvent> events, Failures& failures);
  void dispatch(std::span<const InputEvent> events);

 private:
  struct Entry {
    HandlerId id;
    int priority;
    Handler handler;
  };
  struct Action {
    std::vector<int> keys;
    std::vector<std::pair<HandlerId, ActionHandler>> handlers;
    std::set<int> down;  // keys whose press was reported
  };

  bool route(const InputEvent& event, Failures& failures);
  bool run_actions(const InputEvent& event, Failures& failures);
  bool press(int key, Failures& failures);
  bool release(int key, Failures& failures);
  bool tell(const std::string& action, bool pressed, Failures& failures);
  std::vector<std::string> actions_of(int key) const;

  std::vector<Entry> entries_;
  std::map<std::string, Action, std::less<>> actions_;
  HandlerId next_id_ = 1;
};

}  // namespace fathom::engine
