// Input events recorded frame by frame, and replayed in place of keyboard and mouse.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/front_end.hpp"

namespace fathom::engine {

/// Events with the number of the frame (from 1) in which they arrived, ascending.
struct InputTape {
  struct Entry {
    std::uint64_t frame = 0;
    InputEvent event;

    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::vector<Entry> entries;

  /// A text file, one event per line: frame kind code modifiers x y. Throws `Error{file}`.
  void save(const std::string& path) const;
  static InputTape load(const std::string& path);
};

/// Forwards everything to another front end and records its events.
class RecordingFrontEnd final : public FrontEnd {
 public:
  explicit RecordingFrontEnd(FrontEnd& inner) : inner_(inner) {}
  void poll(std::vector<InputEvent>& events) override;
  void draw(const DrawFrame& frame) override { inner_.draw(frame); }
  bool has_vsync() const override { return inner_.has_vsync(); }
  void set_title(std::string_view title) override { inner_.set_title(title); }
  const InputTape& tape() const { return tape_; }

 private:
  FrontEnd& inner_;
  InputTape tape_;
  std::uint64_t frame_ = 0;
};

/// Replays a tape's events frame by frame; draws on another front end if given.
class PlayingFrontEnd final : public FrontEnd {
 public:
  explicit PlayingFrontEnd(InputTape tape, FrontEnd* inner = nullptr) : tape_(std::move(tape)), inner_(inner) {}
  void poll(std::vector<InputEvent>& events) override;
  void draw(const DrawFrame& frame) override {
    if (inner_) inner_->draw(frame);
  }
  bool has_vsync() const override { return inner_ && inner_->has_vsync(); }
  bool at_end() const { return next_ == tape_.entries.size(); }

 private:
  InputTape tape_;
  FrontEnd* inner_;
  std::uint64_t frame_ = 0;
  std::size_t next_ = 0;
};

}  // namespace fathom::engine
