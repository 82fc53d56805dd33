"""The page that a teacher looks at while the robot learns: ``mplearn live``.

Three processes: one watches and learns (`watching`), one performs with the simulated robot
(`performing`, `robot`), and one serves the page (`server`) and looks after the other two. They
speak in messages (`messages`) over pipes; what the page shows is what the `Hub` last heard.
"""
