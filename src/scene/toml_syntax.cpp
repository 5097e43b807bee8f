// What keeps a text from being TOML, in words for those who write scenes: toml++ describes the state of its parser.
#include <algorithm>
#include <array>

#include "scene/toml_reader.hpp"

namespace fathom {
namespace {

/// Where a message points.
enum class Place : std::uint8_t {
  there,  ///< where toml++ stopped
  word,   ///< at the beginning of the word there
  line,   ///< at the beginning of the line, if that is the name
};

/// How toml++ says something, and how we say it. In `says` "%" is the word there, "@" the name that toml++ has.
struct Phrase {
  std::string_view part;  ///< of what toml++ was reading
  std::string_view why;   ///< of its explanation
  std::string_view says;
  Place place = Place::there;
  bool at_line_end = false;  ///< whether toml++ must have stopped there
};

constexpr std::string_view not_a_value =
    "% is not a value; write a number, true, false, or a text in straight quotation marks";
constexpr std::string_view not_a_number = "% is not a number; write numbers like 3, 0.5 or 1e-3";
constexpr std::string_view zero_first = "% begins with 0; leave that out";

/// The first that fits is taken.
constexpr std::array phrases{
    Phrase{"", "utf-8", "this is not UTF-8; save the file as UTF-8"},
    Phrase{"string", "control characters",
           "a text is not closed on its line; end it with the quotation mark that it begins with", Place::there, true},
    Phrase{"", "control character", "there is a control character here; remove it, or give a text file"},
    Phrase{"", "saw '\\u00", "there is a control character here; remove it, or give a text file"},
    Phrase{"string", "end-of-file",
           "a text is not closed before the end of the file; end it with the quotation marks that it begins with"},
    Phrase{"array", "end-of-file", "a list is not closed before the end of the file; end it with ]"},
    Phrase{"inline table", "end-of-file", "a table is not closed before the end of the file; end it with }"},
    Phrase{"table header", "end-of-file", "the name of a table is not closed; write [name] or [[name]]"},
    Phrase{"", "end-of-file", "the file ends within a line; write key = value"},
    Phrase{"key-value pair", "expected '='", "there is no '=' after the key; write key = value"},
    Phrase{"key-value pair", "expected value, saw", "there is no value after '='; write key = value"},
    Phrase{"table header", "existing array", "'@' is a list above; write [[@]] for one more table of it"},
    Phrase{"table header", "as array-of-tables", "'@' is set above, but not as [[@]]; write [[@]] each time"},
    Phrase{"table header", "existing table", "[@] is there twice; put all its keys into one"},
    Phrase{"table header", "existing", "'@' is set above; give the table another name, or remove one of them"},
    Phrase{"", "as dotted key-value pair", "the table is complete above; put all its keys into one place"},
    Phrase{"key-value pair", "existing", "'@' is set twice; remove one of them", Place::line},
    Phrase{"", "unknown escape",
           "@ has no meaning in a text; write \\\\ for a backslash, or put the text in single quotation marks"},
    Phrase{"unicode", "hex digit", "\\u needs four hexadecimal digits behind it, \\U eight"},
    Phrase{"", "'\\n' after '\\r'", "a line ends with a carriage return alone; save the file with other line ends"},
    Phrase{"", "nested value depth", "brackets are nested too deeply; remove some"},
    Phrase{"integer", "leading zeroes", zero_first, Place::word},
    Phrase{"floating-point", "leading zeroes", zero_first, Place::word},
    Phrase{"integer", "64 bits", "% is too large; a whole number has 64 bits at most", Place::word},
    Phrase{"floating-point", "could not be interpreted",
           "% is too large or too small; numbers have sizes from 1e-307 to 1e308", Place::word},
    Phrase{"integer", "", not_a_number, Place::word},
    Phrase{"floating-point", "", not_a_number, Place::word},
    Phrase{"value", "could not determine", not_a_value, Place::word},
    Phrase{"value", "underscores", not_a_value, Place::word},
    Phrase{"boolean", "", not_a_value, Place::word},
    Phrase{"array", "saw comma", "there is a comma with nothing before it; remove it"},
    Phrase{"array", "expected comma", "a comma or the closing ] is missing before %; write lists like [1, 2, 3]"},
    Phrase{"inline table", "", "a table in { } is on one line; join its lines, or write it below as [name]",
           Place::there, true},
    Phrase{"inline table", "dangling comma", "there is a comma before }; remove it"},
    Phrase{"inline table", "saw comma", "there is a comma with nothing before it; remove it"},
    Phrase{"inline table", "expected comma",
           "a comma or the closing } is missing before %; write tables like {a = 1, b = 2}"},
    Phrase{"table header", "expected ']'", "the name of a table is not closed; write [name] or [[name]]"},
    Phrase{"table header", "blank", "a table needs a name; write [name]"},
    Phrase{"table header", "saw ']'", "there is one ] too many; write [name] or [[name]]"},
    Phrase{"table header", "expected a comment", "% follows the name of the table; write it on a line of its own"},
    Phrase{"key-value pair", "expected a comment",
           "% follows the value; write one key = value per line, texts in quotation marks, lists like [1, 2]"},
    Phrase{"root table", "saw '='", "there is no key before '='; write key = value"},
    Phrase{"root table", "", "% cannot begin a line; write key = value, [table] or # and a comment"},
    Phrase{"key", "expected bare key", "there is no name before %; write key = value or [name]"},
};

/// The bytes of the code point that begins there.
std::size_t code_point_size(std::string_view text, std::size_t at) {
  std::size_t size = 1;
  while (at + size < text.size() && (static_cast<unsigned char>(text[at + size]) & 0xc0) == 0x80) ++size;
  return size;
}

/// Without its end.
std::string_view line_of(std::string_view text, std::size_t number) {
  for (; number > 1; --number) text.remove_prefix(std::min(text.find('\n'), text.size() - 1) + 1);
  return text.substr(0, text.find_first_of("\r\n"));
}

bool ends_word(char c) { return std::string_view(" \t,[]{}=#\"'").find(c) != std::string_view::npos; }

/// On one line and not too long, whatever the file has there.
std::string shown(std::string_view part, std::size_t longest = 60) {
  std::string text;
  for (std::size_t at = 0; at < part.size();) {
    const std::size_t size = code_point_size(part, at);
    if (text.size() + size > longest) return text + "…";
    text += static_cast<unsigned char>(part[at]) < 0x20 ? " " : part.substr(at, size);
    at += size;
  }
  return text;
}

/// What toml++ found, and where.
class SyntaxFault {
 public:
  SyntaxFault(std::string_view text, const toml::parse_error& error)
      : where_(error.source()), why_(error.description()), line_(line_of(text, where_.begin.line)) {
    if (where_.begin.line == 1 && line_.starts_with("\xef\xbb\xbf")) line_.remove_prefix(3);
    for (toml::source_index column = 1; column < where_.begin.column && at_ < line_.size(); ++column)
      at_ += code_point_size(line_, at_);
    constexpr std::string_view opening = "Error while parsing ";
    if (!why_.starts_with(opening)) return;
    why_.remove_prefix(opening.size());
    part_ = why_.substr(0, why_.find(": "));
    why_.remove_prefix(std::min(part_.size() + 2, why_.size()));
  }

  [[noreturn]] void fail(std::string_view file) const {
    const std::string_view rest = line_.substr(at_);
    // Both are read as values.
    if (part_ == "value" && rest.starts_with("="))
      fail_at(file, where_, "there is one '=' too many; write key = value");
    for (const Phrase& phrase : phrases)
      if (fits(phrase))
        fail_at(file, place_of(phrase), filled(wording(phrase), phrase.place == Place::word ? word() : next()));
    fail_at(file, where_, "this is not TOML: " + (part_.empty() ? "" : std::string(part_) + ": ") + shown(why_, 300));
  }

 private:
  bool fits(const Phrase& phrase) const {
    return part_.find(phrase.part) != part_.npos && why_.find(phrase.why) != why_.npos &&
           (!phrase.at_line_end || at_ == line_.size());
  }

  std::string_view wording(const Phrase& phrase) const {
    // The parser takes words that begin like inf or nan for numbers.
    const bool is_number = word().find_first_of("0123456789.+-") == 0;
    return phrase.says == not_a_number && !is_number ? not_a_value : phrase.says;
  }

  std::string filled(std::string_view says, std::string_view found) const {
    std::string text;
    for (const char c : says)
      if (c == '%')
        text += "'" + shown(found) + "'";
      else if (c == '@')
        text += shown(name());
      else
        text += c;
    return text;
  }

  toml::source_region place_of(const Phrase& phrase) const {
    std::size_t at = at_;
    if (phrase.place == Place::word) at = static_cast<std::size_t>(word().data() - line_.data());
    if (phrase.place == Place::line) {
      const std::size_t first = std::min(line_.find_first_not_of(" \t"), line_.size());
      if (line_.substr(first).starts_with(name())) at = first;
    }
    toml::source_region where = where_;
    for (std::size_t back = at; back < at_; back += code_point_size(line_, back)) --where.begin.column;
    return where;
  }

  /// The word around the place.
  std::string_view word() const {
    std::size_t begin = at_, end = at_;
    while (begin > 0 && !ends_word(line_[begin - 1])) --begin;
    while (end < line_.size() && !ends_word(line_[end])) ++end;
    return line_.substr(begin, end - begin);
  }

  /// What follows the place, up to the end of the word; what ends words is one by itself.
  std::string_view next() const {
    std::size_t end = at_;
    while (end < line_.size() && !ends_word(line_[end])) ++end;
    if (at_ == end && end < line_.size()) end += code_point_size(line_, end);
    return line_.substr(at_, end - at_);
  }

  /// What toml++ quotes last.
  std::string_view name() const {
    const std::size_t end = why_.rfind('\'');
    const std::size_t begin = end == why_.npos || end == 0 ? why_.npos : why_.rfind('\'', end - 1);
    return begin == why_.npos ? std::string_view() : why_.substr(begin + 1, end - begin - 1);
  }

  toml::source_region where_;
  std::string_view part_, why_;  ///< what toml++ was reading, and what is wrong with it
  std::string_view line_;
  std::size_t at_ = 0;  ///< of the line's bytes
};

}  // namespace

toml::table parse_toml(std::string_view text, std::string_view file) {
  try {
    return toml::parse(text, file);
  } catch (const toml::parse_error& error) {
    SyntaxFault(text, error).fail(file);
  }
}

}  // namespace fathom
