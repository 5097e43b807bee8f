// Guesses the word meant by a mistyped one.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace fathom {

/// The known word nearest to the given one, or an empty view if none is near: at most a third of the letters differ, or
/// one is the other with words around it, or both begin alike.
std::string_view nearest(std::string_view word, std::span<const std::string_view> known);

/// "; did you mean 'mass'?", or "; known: a, b, c" if no known word is near.
std::string suggestion(std::string_view word, std::span<const std::string_view> known);

}  // namespace fathom
