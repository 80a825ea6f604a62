#include "base/error.h"

namespace rasterbench {
namespace {

std::string located(const Place& place, const std::string& message) {
  std::string text = place.file;
  if (place.line) text += ":" + std::to_string(*place.line);
  if (place.byte) text += ": byte " + std::to_string(*place.byte);
  if (!text.empty()) text += ": ";
  if (!place.field.empty()) text += place.field + ": ";
  return text + message;
}

}  // namespace

InputError::InputError(const Place& place, const std::string& message) : Error(located(place, message)) {}

}  // namespace rasterbench
