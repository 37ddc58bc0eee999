#!/bin/sh
# Takes a picture of what is named, into $PICTURES (default: pictures in the home directory). CAMERA names the program
# that takes it, whose last word will be the file.
folder="${PICTURES:-$HOME/pictures}"
camera="${CAMERA:-rpicam-still --nopreview --timeout 500 -o}"
if ! command -v "${camera%% *}" >/dev/null; then
    echo '{"reason": "the camera is missing"}'
    exit 1
fi
mkdir -p "$folder"
echo '{"progress": 0.5, "text": "the shutter is open"}'
# shellcheck disable=SC2086 - the camera's options are words of their own
$camera "$folder/$1.jpg" || exit 1
echo "{\"results\": {\"picture\": \"$1.jpg\"}}"
