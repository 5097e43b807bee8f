#include "engine/input_tape.hpp"

#include <fmt/format.h>

#include <cmath>
#include <fathom/error.hpp>
#include <sstream>

#include "files/input_file.hpp"
#include "files/output_file.hpp"

namespace fathom::engine {
namespace {

constexpr std::string_view head = "fathom input 1";

[[noreturn]] void refuse(const std::string& path, std::size_t line, const char* why) {
  throw Error(ErrorCode::file, fmt::format("{}:{}: {}", path, line, why));
}

}  // namespace

void InputTape::save(const std::string& path) const {
  std::string text = fmt::format("{}\n", head);
  for (const auto& [frame, e] : entries)
    text += fmt::format("{} {} {} {} {} {}\n", frame, static_cast<int>(e.kind), e.code, e.modifiers, e.x, e.y);
  files::write_file(path, text);
}

InputTape InputTape::load(const std::string& path) {
  std::istringstream file(files::read_file(path, "InputTape::save writes one"));
  std::string line;
  if (!std::getline(file, line) || line != head) refuse(path, 1, "this is not an input tape of fathom");
  InputTape tape;
  for (std::size_t number = 2; std::getline(file, line); ++number) {
    std::istringstream words(line);
    Entry entry;
    int kind = 0, code = 0, modifiers = 0;
    if (!(words >> entry.frame >> kind >> code >> modifiers >> entry.event.x >> entry.event.y))
      refuse(path, number, "an event is six numbers: frame, kind, code, modifiers, x, y");
    if (kind < 0 || kind > static_cast<int>(InputKind::window_closed) || code < 0 || code > 0xffff || modifiers < 0 ||
        modifiers > 0xff || !std::isfinite(entry.event.x) || !std::isfinite(entry.event.y))
      refuse(path, number, "a number is out of range");
    if (entry.frame == 0 || (!tape.entries.empty() && entry.frame < tape.entries.back().frame))
      refuse(path, number, "frames count from 1 and must ascend");
    entry.event.kind = static_cast<InputKind>(kind);
    entry.event.code = static_cast<std::uint16_t>(code);
    entry.event.modifiers = static_cast<std::uint8_t>(modifiers);
    tape.entries.push_back(entry);
  }
  return tape;
}

void RecordingFrontEnd::poll(std::vector<InputEvent>& events) {
  ++frame_;
  const std::size_t before = events.size();
  inner_.poll(events);
  for (std::size_t i = before; i < events.size(); ++i) tape_.entries.push_back({frame_, events[i]});
}

void PlayingFrontEnd::poll(std::vector<InputEvent>& events) {
  ++frame_;
  for (; next_ < tape_.entries.size() && tape_.entries[next_].frame <= frame_; ++next_)
    events.push_back(tape_.entries[next_].event);
}

}  // namespace fathom::engine
