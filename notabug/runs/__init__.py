"""How a run is planned, done and shown: what is chosen, who does the jobs, one job, the folders, what it prints.

``selection`` says what is drawn, ``run`` does it, ``workers`` are the processes, ``judge_files`` judges one job's
pictures, ``progress`` tells of it, ``provenance`` says by which code.
"""
