#include "scene/suggest.hpp"

#include <algorithm>
#include <cctype>
#include <numeric>
#include <vector>

namespace fathom {
namespace {

/// The minimum number of letters to insert, delete or replace, or of neighbours to swap, between two words.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> above(b.size() + 1), row(b.size() + 1), next(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    next[0] = i + 1;
    for (std::size_t j = 0; j < b.size(); ++j) {
      next[j + 1] = std::min({row[j] + (a[i] == b[j] ? 0 : 1), row[j + 1] + 1, next[j] + 1});
      if (i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j]) next[j + 1] = std::min(next[j + 1], above[j - 1] + 1);
    }
    above.swap(row);
    row.swap(next);
  }
  return row.back();
}

/// Whether `part` stands in `whole` as a word of its own: "velocity" in "linear_velocity".
bool has_word(std::string_view whole, std::string_view part) {
  const auto ends_word = [&](std::size_t at) {
    return at >= whole.size() || std::isalnum(static_cast<unsigned char>(whole[at])) == 0;
  };
  for (std::size_t at = whole.find(part); at != whole.npos; at = whole.find(part, at + 1))
    if ((at == 0 || ends_word(at - 1)) && ends_word(at + part.size())) return true;
  return false;
}

/// Whether most of the shorter word begins the other: "gravitation" and "gravity".
bool begin_alike(std::string_view a, std::string_view b) {
  const std::size_t shorter = std::min(a.size(), b.size());
  const auto [end, other] = std::mismatch(a.begin(), a.begin() + static_cast<std::ptrdiff_t>(shorter), b.begin());
  const auto same = static_cast<std::size_t>(end - a.begin());
  return same >= 5 && 3 * same >= 2 * shorter;
}

/// 'DRIFT' means 'drift'.
std::string lower_case(std::string_view word) {
  std::string lower(word);
  for (char& c : lower) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower;
}

struct Nearness {
  bool is_near = false;
  std::size_t cost = 0;      ///< a word too many or too few costs as little as a letter
  std::size_t distance = 0;  ///< decides between equal costs
};

Nearness nearness(std::string_view word, std::string_view candidate) {
  const std::size_t distance = edit_distance(word, candidate);
  if (candidate.empty() || word.empty()) return {};
  // What qualifies a word comes before it: 'damping' may mean 'linear_damping'.
  const bool lacks_qualifier = candidate.ends_with(word) && has_word(candidate, word);
  if (has_word(word, candidate) || lacks_qualifier) return {true, 1, distance};
  const bool is_typo = 3 * distance <= word.size() + 1;
  return {is_typo || begin_alike(word, candidate), distance, distance};
}

}  // namespace

std::string_view nearest(std::string_view word, std::span<const std::string_view> known) {
  std::string_view found;
  Nearness best;
  const std::string lower = lower_case(word);
  for (const std::string_view candidate : known) {
    const Nearness near = nearness(lower, lower_case(candidate));
    if (!near.is_near) continue;
    const bool is_nearer = near.cost != best.cost ? near.cost < best.cost : near.distance < best.distance;
    if (best.is_near && !is_nearer) continue;
    best = near;
    found = candidate;
  }
  return found;
}

std::string suggestion(std::string_view word, std::span<const std::string_view> known) {
  if (const std::string_view found = nearest(word, known); !found.empty()) {
    return "; did you mean '" + std::string(found) + "'?";
  }
  std::string text = "; known: ";
  for (std::size_t i = 0; i < known.size(); ++i) text += (i == 0 ? "" : ", ") + std::string(known[i]);
  return text;
}

}  // namespace fathom
