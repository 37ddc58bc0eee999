"""The HTTP routes: the page, its parts, the stream of events, and the buttons."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Awaitable, Callable, Coroutine
from contextlib import asynccontextmanager
from http import HTTPStatus
from importlib import resources
from string import Template
from typing import Any

from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Route

from hvcpd.config.json_objects import json_object
from hvcpd.config.tasks import TENDING
from hvcpd.console.guard import MAX_BODY_BYTES, Guard, PageAccess
from hvcpd.console.scene import Scene
from hvcpd.console.viewers import Message
from hvcpd.errors import HvcpdError, NotRunningError
from hvcpd.reporting.jsonlines import as_strict_json
from hvcpd.reporting.markup import escaped
from hvcpd.reporting.palette import style_sheet

KEEP_ALIVE_S = 15.0
"""Longest silence towards a page; a tunnel in between may drop a connection that is silent for longer."""

_TYPES = {"js": "text/javascript", "css": "text/css", "svg": "image/svg+xml"}


Ask = Callable[..., Awaitable[dict[str, Any]]]


def live_app(scene: Scene, ask: Ask, run: Callable[[], Coroutine[Any, Any, None]], access: PageAccess) -> Starlette:
    """The page of a running robot; `ask` passes a command on to it, `run` follows it as long as the page is up."""

    async def events(request: Request) -> Response:
        if request.method == "HEAD":  # nothing follows, so it must not take a page's place
            return Response(media_type="text/event-stream")
        if scene.viewers.full:
            return PlainTextResponse("too many pages are open\n", HTTPStatus.SERVICE_UNAVAILABLE)
        return StreamingResponse(_stream(scene), media_type="text/event-stream")

    async def lines(request: Request) -> Response:
        before, after = (_number(request.query_params.get(key)) for key in ("before", "after"))
        return JSONResponse({"lines": scene.lines.page(before, after), "first": scene.lines.first})

    async def act(request: Request) -> Response:
        wanted = await _body(request)
        if wanted is None or wanted.get("do") not in list(_ACTS):
            return JSONResponse({"error": f"give what to do: {', '.join(_ACTS)}"}, HTTPStatus.BAD_REQUEST)
        if wanted["do"] == "resume" and wanted.get("confirmed") is not True:
            return JSONResponse({"error": "resuming must be confirmed"}, HTTPStatus.BAD_REQUEST)
        try:
            return JSONResponse(await _act(wanted, ask, scene.name))
        except NotRunningError as error:
            return JSONResponse({"error": f"{error}. Stop it by voice: “stop”!"}, HTTPStatus.SERVICE_UNAVAILABLE)
        except HvcpdError as error:
            return JSONResponse({"error": str(error)}, HTTPStatus.CONFLICT)

    @asynccontextmanager
    async def following(_: Starlette) -> AsyncIterator[None]:
        task = asyncio.create_task(run())
        yield
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task

    routes = [Route("/events", events), Route("/lines", lines), Route("/act", act, methods=["POST"])]
    index = _page("live", access, lambda: scene.name)
    return _app([Route("/", index), *routes], access, following)


def replay_app(recording: Message, sound: str | None, title: str, access: PageAccess) -> Starlette:
    """The page of a recorded mission; `sound` is the path of its WAV file."""
    body = as_strict_json(recording)

    async def replay(_: Request) -> Response:
        return Response(body, media_type="application/json")

    async def play(_: Request) -> Response:
        if sound is None:
            return PlainTextResponse("no sound was recorded\n", HTTPStatus.NOT_FOUND)
        return FileResponse(sound, media_type="audio/wav")

    routes = [Route("/", _page("replay", access, lambda: title)), Route("/replay", replay), Route("/sound", play)]
    return _app(routes, access, None)


def _app(routes: list[Route], access: PageAccess, lifespan: Any) -> Starlette:
    parts = [Route("/style.css", _style), Route("/part/{name:str}", _part)]
    return Starlette(routes=[*routes, *parts], middleware=[Middleware(Guard, access=access)], lifespan=lifespan)


_ACTIONS = "".join(f"<option>{action}</option>" for action in (*TENDING, "wait"))
"""What a new task can have done at its place, as HTML."""


def _page(mode: str, access: PageAccess, title: Callable[[], str]) -> Callable[[Request], Awaitable[Response]]:
    template = Template(_own("index.html"))

    async def page(_: Request) -> Response:
        text = template.substitute(mode=mode, token=access.token, title=escaped(title() or "a robot"), actions=_ACTIONS)
        return Response(text, media_type="text/html; charset=utf-8")

    return page


async def _style(_: Request) -> Response:
    style = str(style_sheet("theme.css", "report.css")) + _own("console.css")
    return Response(style, media_type="text/css", headers={"cache-control": "no-cache"})


async def _part(request: Request) -> Response:
    name = request.path_params["name"]
    if name not in _PARTS:
        return PlainTextResponse("there is no such part\n", HTTPStatus.NOT_FOUND)
    kind = _TYPES[name.rpartition(".")[2]]
    return Response(_own(name), media_type=kind, headers={"cache-control": "no-cache"})


def _own(name: str) -> str:
    return resources.files("hvcpd.console").joinpath("page", name).read_text(encoding="utf-8")


_FOR_ALL = {"again": "is done again", "skip": "is left out this time"}
"""Changes of a task by the whole team, with the message for each."""
_FOR_ONE = {"add": "is taken up as soon as its words are known", "remove": "is gone"}
"""Changes of a task by this robot alone, with the message for each."""
_ACTS = ("stop", "resume", *_FOR_ALL, *_FOR_ONE)

_PARTS = frozenset(
    each.name for each in resources.files("hvcpd.console").joinpath("page").iterdir() if not each.name.endswith("html")
)


async def _stream(scene: Scene) -> AsyncIterator[str]:
    """Server-sent events (HTML standard, 9.2): a snapshot, then each change."""
    viewer = scene.viewers.join()
    try:
        yield _event(scene.snapshot())
        while not viewer.ended:
            try:
                async with asyncio.timeout(KEEP_ALIVE_S):
                    messages = await viewer.take(scene.snapshot)
            except TimeoutError:
                yield ": still here\n\n"
            else:
                yield "".join(map(_event, messages))
    finally:
        scene.viewers.leave(viewer)


def _event(message: Message) -> str:
    return f"data: {as_strict_json(message)}\n\n"


async def _act(wanted: dict[str, Any], ask: Ask, name: str) -> dict[str, Any]:
    """Change a task, or stop or resume this robot; with `all` the robot then calls the same to all others."""
    word, is_for_all = wanted["do"], wanted.get("all") is True
    if word == "resume":
        return _resumed(await ask(word, **({"all": True} if is_for_all else {})), name, is_for_all)
    if word != "stop":
        number, task = wanted.get("number"), wanted.get("task")
        if word == "add":
            done = await ask("task", do=word, task=task)
            number = task.get("number") if isinstance(task, dict) else None
        else:
            done = await ask("task", do=word, number=number)
        if word in _FOR_ONE:
            return {"told": f"task {number} {_FOR_ONE[word]}; the others are not told: do the same for each", **done}
        return {"told": f"task {number} {_FOR_ALL[word]}: {name} tells the others", **done}
    stopping = asyncio.ensure_future(ask(word))
    await asyncio.sleep(0)  # asked for first; it is answered once it is on the disk, and the others do not wait
    text = f"{name} is stopped"
    if is_for_all:
        try:
            await ask("say", text="stop")  # alone and at once: each further word costs the others a third of a second
            text += ", and says “stop” to all others"
        except HvcpdError as error:
            text += f"; but the others could not be told: {error}"
    done = await stopping
    return {"told": text if done["stopped"] else f"{name} was released meanwhile", **done}


def _resumed(done: dict[str, Any], name: str, is_for_all: bool) -> dict[str, Any]:
    """The reply to a page after the daemon's to `resume`."""
    text = f"{name} may take on tasks again"
    if done["stopped"]:
        text = f"{name} was stopped again meanwhile"
    elif done.get("untold") is not None:
        text += f"; but the others could not be told: {done['untold']}"
    elif is_for_all:
        text += ", and says “resume” to all others as soon as nobody else speaks"
    return {"told": text, **done}


async def _body(request: Request) -> dict[str, Any] | None:
    """The request's JSON object; None if it has none or is too long."""
    raw = b""
    async for chunk in request.stream():
        raw += chunk
        if len(raw) > MAX_BODY_BYTES:
            return None
    return json_object(raw)


def _number(text: str | None) -> int | None:
    return int(text) if text is not None and text.isascii() and text.isdigit() and len(text) <= 12 else None
