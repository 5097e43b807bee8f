#include "engine/input.hpp"

#include <algorithm>
#include <array>
#include <fathom/error.hpp>

#include "scene/suggest.hpp"

namespace fathom::engine {
namespace {

struct NamedKey {
  std::string_view name;
  int code;
};

// GLFW's key codes (glfw3.h), so its events need no table; mouse buttons are −2 − button.
constexpr std::array named_keys{
    NamedKey{"space", 32},         NamedKey{"apostrophe", 39},
    NamedKey{"comma", 44},         NamedKey{"minus", 45},
    NamedKey{"period", 46},        NamedKey{"slash", 47},
    NamedKey{"semicolon", 59},     NamedKey{"equal", 61},
    NamedKey{"left_bracket", 91},  NamedKey{"backslash", 92},
    NamedKey{"right_bracket", 93}, NamedKey{"grave", 96},
    NamedKey{"escape", 256},       NamedKey{"enter", 257},
    NamedKey{"tab", 258},          NamedKey{"backspace", 259},
    NamedKey{"insert", 260},       NamedKey{"delete", 261},
    NamedKey{"right", 262},        NamedKey{"left", 263},
    NamedKey{"down", 264},         NamedKey{"up", 265},
    NamedKey{"page_up", 266},      NamedKey{"page_down", 267},
    NamedKey{"home", 268},         NamedKey{"end", 269},
    NamedKey{"pause", 284},        NamedKey{"f1", 290},
    NamedKey{"f2", 291},           NamedKey{"f3", 292},
    NamedKey{"f4", 293},           NamedKey{"f5", 294},
    NamedKey{"f6", 295},           NamedKey{"f7", 296},
    NamedKey{"f8", 297},           NamedKey{"f9", 298},
    NamedKey{"f10", 299},          NamedKey{"f11", 300},
    NamedKey{"f12", 301},          NamedKey{"left_shift", 340},
    NamedKey{"left_control", 341}, NamedKey{"left_alt", 342},
    NamedKey{"right_shift", 344},  NamedKey{"right_control", 345},
    NamedKey{"right_alt", 346},    NamedKey{"mouse_left", -2},
    NamedKey{"mouse_right", -3},   NamedKey{"mouse_middle", -4},
};
constexpr std::string_view letters_and_digits = "abcdefghijklmnopqrstuvwxyz0123456789";

bool is_press(InputKind kind) { return kind == InputKind::key_pressed || kind == InputKind::mouse_pressed; }
bool is_release(InputKind kind) { return kind == InputKind::key_released || kind == InputKind::mouse_released; }

/// Key code of a press or release, as in `key_named`.
int key_of(const InputEvent& event) {
  const bool is_button = event.kind == InputKind::mouse_pressed || event.kind == InputKind::mouse_released;
  return is_button ? -2 - event.code : event.code;
}

}  // namespace

int key_named(std::string_view name) {
  if (name.size() == 1 && letters_and_digits.find(name[0]) != std::string_view::npos)
    return name[0] >= 'a' ? name[0] - 'a' + 'A' : name[0];
  for (const NamedKey& key : named_keys)
    if (key.name == name) return key.code;
  return -1;
}

std::string name_of_key(int code) {
  for (const NamedKey& key : named_keys)
    if (key.code == code) return std::string(key.name);
  if (code >= 'A' && code <= 'Z') return std::string(1, static_cast<char>(code - 'A' + 'a'));
  if (code >= '0' && code <= '9') return std::string(1, static_cast<char>(code));
  return "key " + std::to_string(code);
}

std::span<const std::string_view> key_names() {
  static const std::vector<std::string_view> names = [] {
    std::vector<std::string_view> all;
    for (const NamedKey& key : named_keys) all.push_back(key.name);
    for (std::size_t i = 0; i < letters_and_digits.size(); ++i) all.push_back(letters_and_digits.substr(i, 1));
    return all;
  }();
  return names;
}

Input::HandlerId Input::add_handler(int priority, Handler handler) {
  const auto after =
      std::find_if(entries_.begin(), entries_.end(), [&](const Entry& entry) { return entry.priority < priority; });
  entries_.insert(after, {next_id_, priority, std::move(handler)});
  return next_id_++;
}

void Input::remove_handler(HandlerId id) {
  std::erase_if(entries_, [id](const Entry& entry) { return entry.id == id; });
  for (auto& [name, action] : actions_)
    std::erase_if(action.handlers, [id](const auto& handler) { return handler.first == id; });
}

void Input::bind(std::string_view action, std::string_view key) {
  const int code = key_named(key);
  if (code == -1) {
    throw Error(ErrorCode::invalid_argument, "action '" + std::string(action) + "': there is no key '" +
                                                 std::string(key) + "'" + suggestion(key, key_names()));
  }
  std::vector<int>& keys = actions_[std::string(action)].keys;
  if (std::find(keys.begin(), keys.end(), code) == keys.end()) keys.push_back(code);
}

Input::HandlerId Input::on_action(std::string_view action, ActionHandler handler) {
  actions_[std::string(action)].handlers.emplace_back(next_id_, std::move(handler));
  return next_id_++;
}

bool Input::held(std::string_view action) const {
  const auto found = actions_.find(action);
  return found != actions_.end() && !found->second.down.empty();
}

void Input::dispatch(std::span<const InputEvent> events) {
  Failures failures;
  dispatch(events, failures);
  failures.throw_first();
}

void Input::dispatch(std::span<const InputEvent> events, Failures& failures) {
  for (const InputEvent& event : events) {
    route(event, failures);
    // Whether or not the event was consumed, the key is up.
    if (is_release(event.kind)) release(key_of(event), failures);
    // From now on, another window gets the releases.
    if (event.kind != InputKind::window_unfocused) continue;
    std::set<int> down;
    for (const auto& [name, action] : actions_) down.insert(action.down.begin(), action.down.end());
    for (const int key : down) release(key, failures);
  }
}

// Handlers may add and remove handlers: iterates over a copy and skips those removed meanwhile.
bool Input::route(const InputEvent& event, Failures& failures) {
  bool actions_due = true;
  const std::vector<Entry> entries = entries_;
  for (const Entry& entry : entries) {
    if (actions_due && entry.priority < action_priority) {
      actions_due = false;
      if (run_actions(event, failures)) return true;
    }
    const bool lives =
        std::any_of(entries_.begin(), entries_.end(), [&](const Entry& other) { return other.id == entry.id; });
    bool consumed = false;
    if (lives) failures.guard([&] { consumed = entry.handler(event); });
    if (consumed) return true;
  }
  return actions_due && run_actions(event, failures);
}

bool Input::run_actions(const InputEvent& event, Failures& failures) {
  if (is_press(event.kind)) return press(key_of(event), failures);
  return is_release(event.kind) && release(key_of(event), failures);
}

bool Input::press(int key, Failures& failures) {
  bool consumed = false;
  for (const std::string& name : actions_of(key)) {
    actions_[name].down.insert(key);
    consumed = tell(name, true, failures) || consumed;
  }
  return consumed;
}

bool Input::release(int key, Failures& failures) {
  bool consumed = false;
  for (const std::string& name : actions_of(key)) {
    Action& action = actions_[name];
    consumed = consumed || !action.handlers.empty();
    if (action.down.erase(key) > 0 && action.down.empty()) tell(name, false, failures);
  }
  return consumed;
}

// Here, too, handlers may be added and removed.
bool Input::tell(const std::string& name, bool pressed, Failures& failures) {
  const auto handlers = actions_[name].handlers;
  for (const auto& [id, handler] : handlers) {
    const auto& left = actions_[name].handlers;
    const bool lives =
        std::any_of(left.begin(), left.end(), [key = id](const auto& other) { return other.first == key; });
    if (lives) failures.guard([&, &act = handler] { act(pressed); });
  }
  return !handlers.empty();
}

std::vector<std::string> Input::actions_of(int key) const {
  std::vector<std::string> names;
  for (const auto& [name, action] : actions_)
    if (std::find(action.keys.begin(), action.keys.end(), key) != action.keys.end()) names.push_back(name);
  return names;
}

}  // namespace fathom::engine
